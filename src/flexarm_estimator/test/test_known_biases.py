"""What a run over a window knows of the biases is what the estimator knew where it begins."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flexarm_estimator.filter import Belief
from flexarm_estimator.isolation.hypotheses import Hypotheses, Rearrangement
from flexarm_estimator.isolation.known_biases import KnownBiases, known_biases, told_biases
from flexarm_estimator.state.state_layout import StateLayout

LAYOUT = StateLayout(2, 1, ("gauge.strain", "gauge.strain rate"))
P0 = np.diag([*np.ones(5), 20e-6**2, 1e-12])
PARTS: Any = SimpleNamespace(
    layout=LAYOUT,
    process=SimpleNamespace(P0=P0),
    sensors=SimpleNamespace(rows={"gauge": SimpleNamespace(channels=("strain",))}),
)
CHANNELS: Any = SimpleNamespace(sigma=np.array([1e-5, 1e-6]), spans={"gauge": slice(1, 2)})


@pytest.mark.parametrize(("learned", "counts"), [(1e-7, 5e-6), (8e-6, 8e-6), (1e-3, 20e-6)])
def test_a_bias_is_known_as_well_as_learned_but_for_five_sigmas_of_noise(
    learned: float, counts: float
) -> None:
    x, P = np.arange(7.0), P0.copy()
    P[5, 5] = learned**2
    mean, variance, _ = known_biases(told_biases(Belief(x, P), PARTS), PARTS, CHANNELS)
    assert mean.tolist() == [5.0, 6.0]
    assert variance[0] == pytest.approx(counts**2)


def test_what_is_no_bias_of_a_channel_is_as_little_known_as_at_the_start() -> None:
    told = told_biases(Belief(np.zeros(7), 1e-9 * P0), PARTS)
    assert known_biases(told, PARTS, CHANNELS).variance[1] == P0[6, 6]


def test_what_is_rearranged_takes_its_bias_along() -> None:
    """Of three channels the first has none, and the rate of drift belongs to nobody."""
    order, plus = np.arange(3), np.ones(3)
    table = Hypotheses.of(
        [
            Rearrangement((), "", order, plus),
            Rearrangement((1,), "", order, np.array([1.0, -1.0, 1.0])),
            Rearrangement((1, 2), "", np.array([0, 2, 1]), plus),
            Rearrangement((0, 1), "", np.array([1, 0, 2]), plus),
        ]
    )
    known = KnownBiases(np.array([5.0, 7.0, 0.3]), np.ones(3), np.array([1, 2, -1]))
    means = known.under(table).T.tolist()
    assert means == [[5.0, 7.0, 0.3], [-5.0, 7.0, 0.3], [7.0, 5.0, 0.3], [0.0, 7.0, 0.3]]
    shifts = [known.shift(one).tolist() for one in table.all]
    assert shifts == [[0.0, 0.0, 0.0], [0.0, -10.0, 0.0], [0.0, 2.0, -2.0], [0.0, -5.0, 0.0]]
