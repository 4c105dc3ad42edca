"""The minimum of sums over frames: exact on parabolas, alike for one fit and for many, its spread honest."""

import numpy as np
import pytest

from flexarm_estimator.watches.delay_minimum import Sums, find_minimum, spread_of

CANDIDATES = np.linspace(-0.02, 0.2, 45)


def test_the_minimum_of_a_parabola_is_exact():
    found = find_minimum(3.0 + 40.0 * (CANDIDATES - 0.0613) ** 2, CANDIDATES)
    assert float(found.value) == pytest.approx(0.0613, abs=1e-12)
    assert float(found.least) == pytest.approx(3.0, abs=1e-12)
    assert float(found.bend) == pytest.approx(80.0, rel=1e-9)


def test_several_fits_are_found_as_one_by_one_and_those_at_an_end_have_no_minimum():
    J = np.array([(CANDIDATES - at) ** 2 for at in (0.03, 0.1, 0.5, -0.3)])
    many = find_minimum(J, CANDIDATES)
    assert (many.bend > 0.0).tolist() == [True, True, False, False]
    for i, row in enumerate(J[:2]):
        one = find_minimum(row, CANDIDATES)
        assert (float(one.value), float(one.bend)) == (float(many.at(i).value), float(many.at(i).bend))


def blocks_of(rng, sigma, common, count=200, frames=10):
    """Frames of a tip whose velocity is drawn; of the error a part is common to the frames of a block [m]."""
    sums = Sums(np.zeros((count, 45, 3)), np.zeros((count, 45)), np.full(count, float(frames)))
    for b in range(count):
        v, shared = rng.normal(size=3), common * rng.normal(size=3)
        for _ in range(frames):
            r = v * (CANDIDATES[:, None] - 0.06) + shared + sigma * rng.normal(size=3)
            sums.residuals[b] += r
            sums.squares[b] += (r * r).sum(axis=1)
    return sums


@pytest.mark.parametrize(("common", "expected"), [(0.0, 2.0), (1.0, 2.0 * (1.0 + 10.0))])
def test_the_spread_is_twice_the_variance_times_what_frames_have_in_common(common, expected):
    """Of n frames with a common error of as much variance the mean scatters by (1 + n) / n."""
    sigma = 1e-3
    blocks = blocks_of(np.random.default_rng(1), sigma, common * sigma)
    spread = spread_of(blocks, find_minimum(blocks.total().misfits(), CANDIDATES), CANDIDATES)
    assert spread == pytest.approx(expected * sigma**2, rel=0.3)  # 200 blocks: 10 % one sigma
    assert (
        spread_of(blocks.part(0, 1), find_minimum(blocks.part(0, 1).misfits()[0], CANDIDATES), CANDIDATES)
        == 0
    )
