"""A sensor that is left out is heard again when it agrees with the others, however wide the gate is."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from planar_strip import DT, SENSORS, StripKinematics, strip_model
from test_exclusion import standing, status_of

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.judging.gate import Gate
from flexarm_estimator.settings import EstimatorConfig

WIDE = EstimatorConfig(gate=30.0)
WRONG_UNTIL, END = 240, 320  # instants; 1.2 s and 1.6 s
OFF = 15.0  # m/s^2: less than the gate beside a prediction that knows the vibration badly


MOVE, REST = 40, 180  # instants in which a sensor shows that it is wrong, and in which it does not


def say(offset: float, is_wrong: Callable[[int], bool], end: int) -> list[str]:
    """Return the status of an accelerometer that is off at some instants [m/s^2], in every period."""
    estimator = Estimator(strip_model(), StripKinematics(), SENSORS, WIDE)
    rng, told = np.random.default_rng(4), []
    for k in range(end):
        off = {"tip_accelerometer": offset * is_wrong(k)}
        samples = [s._replace(y=s.y + off.get(s.sensor, 0.0)) for s in standing(0.3, k, rng)]
        told.append(status_of(estimator.step(samples, np.zeros(1), k * DT), "tip_accelerometer"))
    return told


def test_a_sensor_that_stays_grossly_wrong_is_not_heard_again_until_it_is_right() -> None:
    told = say(OFF, lambda k: k < WRONG_UNTIL, END)
    found = told.index("faulty")
    assert set(told[found:WRONG_UNTIL]) == {"faulty"}
    assert set(told[-20:]) == {"ok"}


def test_a_sensor_that_is_wrong_in_every_move_is_not_believed_again_at_every_rest() -> None:
    """As one of a wrong factor: it agrees at rest, and every next move began with it believed."""
    told = say(OFF, lambda k: k % (MOVE + REST) < MOVE, 6 * (MOVE + REST))
    out = [k for k, (before, now) in enumerate(pairwise(told)) if now == "faulty" != before]
    back = [k for k, (before, now) in enumerate(pairwise(told)) if before == "faulty" != now]
    assert (back[0] - out[0]) * DT < 0.3  # at first as soon as one whose plug was loose
    assert len(out) == 4  # agrees for 0.2, 0.4 and 0.8 s; for 1.6 s it does not while the arm is at work
    assert told[-1] == "faulty"


@pytest.mark.parametrize(("gate", "expected"), [(30.0, 25.0), (5.0, 25.0), (3.0, 9.0)])
def test_agreement_is_five_sigma_or_the_gate_where_that_is_narrower(gate: float, expected: float) -> None:
    assert Gate({"a": [1.0]}, EstimatorConfig(gate=gate)).agreement("a") == pytest.approx(expected)
