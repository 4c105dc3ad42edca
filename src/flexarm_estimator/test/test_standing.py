"""What stands of all interventions makes a new estimator like the old one, but for its state."""

import numpy as np
import pytest
from planar_strip import SENSORS
from test_interventions import CONFIG, do, estimator, run

from flexarm_estimator.interventions.reset import Reset
from flexarm_estimator.interventions.set_noise import SETTINGS, SetNoise
from flexarm_estimator.interventions.set_state import SetState
from flexarm_estimator.interventions.standing import read_standing, standing, write_standing
from flexarm_estimator.interventions.toggle_sensor import ToggleSensor

TURNS = ("rx", "ry", "rz")
TURNS_OFF, TURNS_ON = (ToggleSensor("camera", is_on, TURNS) for is_on in (False, True))
GAUGE_OFF, GAUGE_ON = (ToggleSensor("root_strain", is_on) for is_on in (False, True))


@pytest.mark.parametrize(
    ("done", "count"),
    [
        ((), 0),
        ((GAUGE_OFF,), 1),
        ((GAUGE_OFF, GAUGE_ON), 0),
        ((TURNS_OFF, ToggleSensor("camera", False)), 2),
        ((TURNS_OFF, SetNoise("camera", (1e-3, 2e-3, 3e-3))), 2),
        ((TURNS_OFF, SetNoise("camera", (1e-3, 2e-3, 3e-3)), TURNS_ON), 1),
        ((SetNoise("camera", (1e-3,)), TURNS_OFF), 2),
        ((SetNoise("camera", (1e-3,)), TURNS_OFF, TURNS_ON), 1),
        ((SetNoise("encoder", (1e-3,)), SetNoise("encoder", tuple(SENSORS[0].sigma))), 0),
        (tuple(SetNoise(name, (0.017,)) for name in SETTINGS), len(SETTINGS)),
        ((Reset(),), 0),
    ],
)
def test_what_stands_makes_an_estimator_like_the_one_it_is_of(done, count):
    made, again = estimator(), estimator()
    for each in done:
        do(made, each)
    told = read_standing(write_standing(tuple(standing(made, SENSORS, CONFIG))))
    assert len(told) == count
    for each in told:
        do(again, each)
    assert again.config == made.config
    for one, other in zip(made.specs, again.specs, strict=True):
        assert one.channels == other.channels
        np.testing.assert_array_equal(one.sigma, other.sigma)
    do(made, Reset())
    found, expected = run(again, 0, 30), run(made, 0, 30)
    assert [r[:3] for r in found.sensors] == [r[:3] for r in expected.sensors]
    np.testing.assert_allclose(found.x, expected.x, rtol=1e-9, atol=1e-12)


def test_a_state_that_was_set_does_not_stand():
    made = estimator()
    do(made, SetState((0.1,)))
    assert write_standing(tuple(standing(made, SENSORS, CONFIG))) == ""


@pytest.mark.parametrize(
    "text", ["[", "[1]", '[{"sensor": "x"}]', '[{"kind": "Reset"}]', '[{"kind": "SetNoise"}]']
)
def test_a_text_that_nobody_has_written_here_is_refused(text):
    with pytest.raises(ValueError, match=r"\w"):
        read_standing(text)
