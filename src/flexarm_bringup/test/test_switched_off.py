"""A record in which a user switched sensors, or did more: what of it a likelihood may count."""

import numpy as np
import pytest

from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.consistency.switched_off import refuse_other_filters, without_switched_off
from flexarm_estimator.interventions.intervention import Intervention
from flexarm_estimator.interventions.reset import Reset
from flexarm_estimator.interventions.set_noise import SetNoise
from flexarm_estimator.interventions.set_state import SetState
from flexarm_estimator.interventions.toggle_sensor import ToggleSensor
from flexarm_estimator.measurement import Measurement

TIMES = [0.1 * k for k in range(6)]


def kept(*done: tuple[float, Intervention]) -> list[float]:
    """Return the times of the gauge's samples that are left; the encoder's all are."""
    samples = [Measurement(name, t, np.zeros(1)) for t in TIMES for name in ("encoder", "gauge")]
    left = without_switched_off(samples, done)
    assert [sample.t for sample in left if sample.sensor == "encoder"] == TIMES
    return [round(sample.t, 9) for sample in left if sample.sensor == "gauge"]


def test_a_sensor_that_is_off_says_nothing_of_its_noise() -> None:
    """A broken gauge that its user had switched off was tuned on, and all others with it."""
    off, on = (0.15, ToggleSensor("gauge", False)), (0.35, ToggleSensor("gauge", True))
    assert kept(off) == [0.0, 0.1]
    assert kept(on, off) == [0.0, 0.1, 0.4, 0.5]  # in any order
    assert kept((0.2, ToggleSensor("gauge", False))) == [0.0, 0.1, 0.2]  # it acts from the next step on


def test_a_sensor_with_a_channel_off_is_left_out_until_all_are_on() -> None:
    x_off, y_off = (ToggleSensor("gauge", False, (channel,)) for channel in "xy")
    both_on = ToggleSensor("gauge", True, ("x", "y"))
    assert kept((0.05, x_off), (0.15, y_off), (0.25, ToggleSensor("gauge", True, ("x",)))) == [0.0]
    assert kept((0.05, x_off), (0.15, y_off), (0.25, both_on)) == [0.0, 0.3, 0.4, 0.5]


@pytest.mark.parametrize(
    ("done", "said"),
    [
        (Reset(), "starting anew"),
        (SetNoise("encoder", (1e-3,)), "encoder"),
        (SetState(theta=(0.0,)), "state"),
    ],
)
def test_what_makes_another_filter_is_refused_with_its_place(done: Intervention, said: str) -> None:
    with pytest.raises(BagError, match=f"bag: after 0.400 s a user interfered .*{said}"):
        refuse_other_filters([(100.0, ToggleSensor("gauge", False)), (100.4, done)], "bag", 100.0)
    refuse_other_filters([(100.0, ToggleSensor("gauge", False))], "bag", 100.0)
