"""The elbow arm of seed 004: printed and golden positions, four solutions, refusals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from finite_difference import assert_jacobian
from hypothesis import given, settings
from hypothesis import strategies as st

from flexarm_model.kinematics.branches import wrap
from flexarm_model.kinematics.elbow_arm import ElbowArm
from flexarm_model.kinematics.refusals import ReachError, SingularPoseError

ARM = ElbowArm(0.040, 0.290, 0.240)  # seed 004, table 2
BENT_DEG = st.floats(2.0, 178.0).flatmap(lambda a: st.sampled_from([a, -a]))
EXAMPLES = settings(max_examples=200, deadline=None, derandomize=True)
GOLDEN = [  # seed 004, section 4: angles [deg], tip [mm]
    ((0.0, 16.0, 0.0), (509.469, 0.0, 186.088)),
    ((0.0, 16.0, -45.0), (488.675, 0.0, 3.581)),
    ((30.0, 60.0, -45.0), (326.338, 188.411, 353.264)),
]


@pytest.mark.parametrize(("q_deg", "tip_mm"), GOLDEN)
def test_tip_is_where_the_note_says(q_deg: tuple[float, ...], tip_mm: tuple[float, ...]) -> None:
    np.testing.assert_allclose(1e3 * ARM.position(np.radians(q_deg)), tip_mm, atol=0.6e-3)  # last digit


@EXAMPLES
@given(st.floats(-179.9, 179.9), st.floats(-179.9, 179.9), BENT_DEG)
def test_inverse_of_forward_is_the_identity_to_1e_minus_9_deg(
    azimuth: float, shoulder: float, elbow: float
) -> None:
    q = np.radians([azimuth, shoulder, elbow])
    p = ARM.position(q)
    radius = ARM.upper * math.cos(q[1]) + ARM.fore * math.cos(q[1] + q[2])
    if abs(radius) < 1e-3:  # the azimuth is hardly defined
        return
    facing, bend = (1 if radius > 0.0 else -1), (1 if elbow > 0.0 else -1)
    assert np.degrees(abs(wrap(ARM.solve(p, bend, facing) - q)).max()) < 1e-9
    assert np.degrees(abs(ARM.nearest(p, q) - q).max()) < 1e-9


@EXAMPLES
@given(st.floats(-3.1, 3.1), st.floats(-3.1, 3.1), BENT_DEG)
def test_all_four_solutions_reach_the_tip_and_differ(azimuth: float, shoulder: float, elbow: float) -> None:
    q = np.array([azimuth, shoulder, math.radians(elbow)])
    p = ARM.position(q)
    if math.hypot(p[0], p[1]) < 1e-3:
        return
    found = ARM.solutions(p)
    np.testing.assert_allclose([ARM.position(x) for x in found], np.tile(p, (4, 1)), atol=1e-13)
    gaps = [abs(wrap(a - b)).max() for i, a in enumerate(found) for b in found[:i]]
    assert min(gaps) > 1e-3


@pytest.mark.parametrize("seed", range(5))
def test_table_of_denavit_and_hartenberg_gives_tip_and_jacobian(seed: int) -> None:
    q = np.random.default_rng(seed).uniform(-3.0, 3.0, 3)
    np.testing.assert_allclose(ARM.chain.pose(q)[:3, 3], ARM.position(q), atol=1e-15)
    np.testing.assert_allclose(ARM.chain.jacobian(q)[:3], ARM.jacobian(q), atol=1e-15)
    assert_jacobian(ARM.position, q, ARM.jacobian(q))


def test_what_is_out_of_reach_is_refused() -> None:
    with pytest.raises(ReachError, match=r"tip .*: distance 0\.600000? m|distance 0\.6 m"):
        ARM.solutions(np.array([0.6, 0.0, ARM.height]))
    with pytest.raises(ReachError, match=r"distance 0\.02 m, the links reach 0\.05 \.\.\. 0\.53 m"):
        ARM.nearest(np.array([0.0, 0.0, ARM.height + 0.02]), np.zeros(3))


def test_above_the_base_the_azimuth_is_refused_or_kept() -> None:
    q = np.array([0.4, math.pi / 2, 0.0])
    q[2] = 2.0
    q[1] = math.pi / 2 - math.atan2(ARM.fore * math.sin(2.0), ARM.upper + ARM.fore * math.cos(2.0))
    p = ARM.position(q)
    with pytest.raises(SingularPoseError, match="azimuth is free"):
        ARM.solve(p, 1)
    np.testing.assert_allclose(ARM.nearest(p, q), q, atol=1e-12)
