"""Faults of sensors that come and go while the simulated rig runs."""

from __future__ import annotations

import numpy as np
import pytest

from flexarm_bringup.sim.drives import Drives
from flexarm_bringup.sim.rig import Rig, RigSettings
from flexarm_bringup.sim.sensor_faults import SensorFault
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.parameters import ParameterError

CONFIG = load_config(find_manipulator("single_link"), "geared")
TAU = np.array([1.0])


def heard(rig: Rig, ticks: int) -> list[tuple[int, str, float]]:
    return [(s.tick, s.sensor, float(s.y[0])) for _ in range(ticks) for s in rig.step(TAU)]


@pytest.fixture(scope="module")
def plant_of() -> Rig:
    return Rig(CONFIG)


def test_times_of_a_fault_count_from_when_it_was_given(plant_of: Rig) -> None:
    rig = Rig(CONFIG, plant=plant_of.plant)
    heard(rig, 40)
    rig.set_faults({"root_strain": SensorFault("off", 0.05, 0.1)})
    silent = set(range(41, 81)) - {tick for tick, name, _ in heard(rig, 40) if name == "root_strain"}
    assert silent == set(range(50, 60))


def test_a_fault_that_is_taken_back_leaves_no_trace_on_what_sensors_say_later(plant_of: Rig) -> None:
    told = []
    for has_fault in (False, True):
        rig = Rig(CONFIG, plant=plant_of.plant)
        before = heard(rig, 20)
        if has_fault:
            rig.set_faults({"root_strain": SensorFault("bias", bias=1.0), "encoder": SensorFault("stuck")})
        during = heard(rig, 20)
        rig.set_faults({})
        told.append((before, during, heard(rig, 20)))
    assert told[0][0] == told[1][0] and told[0][2] == told[1][2] and told[0][1] != told[1][1]


def test_delayed_samples_still_arrive_when_the_fault_has_gone(plant_of: Rig) -> None:
    rig = Rig(CONFIG, plant=plant_of.plant)
    rig.set_faults({"root_strain": SensorFault("delayed", delay=0.05)})
    first = heard(rig, 20)
    rig.set_faults({})
    later = heard(rig, 20)
    assert sorted(tick for tick, name, _ in first + later if name == "root_strain") == list(range(1, 41))


def test_drives_measure_for_themselves_from_when_an_encoder_has_a_fault(plant_of: Rig) -> None:
    drives = Drives(CONFIG, plant=plant_of.plant)
    drives.is_released, drives.tau = True, [1.0]
    for _ in range(100):
        drives.advance()
    before = drives.state()
    drives.set_faults({"encoder": SensorFault("stuck")})
    assert drives.state() == before
    for _ in range(100):
        drives.advance()
    assert drives.state().position[0] > before.position[0] + 0.01
    assert drives.motors.theta[0] == pytest.approx(before.position[0], abs=0.01)


@pytest.mark.parametrize(
    ("faults", "reason"),
    [
        ({"nix": SensorFault("off")}, "faults: 'nix' is not one of encoder, root_strain"),
        ({"nix": None}, "faults: 'nix' is not one of encoder, root_strain"),
        ({"encoder": "off"}, "faults: encoder: expected a SensorFault, not 'off'"),
    ],
)
def test_a_fault_of_no_sensor_is_refused_by_name(plant_of: Rig, faults: dict, reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        Rig(CONFIG, plant=plant_of.plant, faults=faults)
    rig = Rig(CONFIG, plant=plant_of.plant, faults={"root_strain": SensorFault("off")})
    with pytest.raises(ValueError, match=reason):
        rig.set_faults(faults)
    assert set(rig.faults) == {"root_strain"}


@pytest.mark.parametrize(
    ("settings", "reason"),
    [
        ({"noise": -1.0}, r"noise: -1.0 is not a finite number in \[0.0, 100.0\]"),
        ({"friction": -5.0}, "friction: -5.0 is not a finite number"),
        ({"mass_scale": float("nan")}, "mass_scale: nan is not a finite number"),
        ({"extra_modes": -1}, "extra_modes: -1 is not a finite number"),
    ],
)
def test_a_rig_that_cannot_be_is_refused_by_name(settings: dict, reason: str) -> None:
    with pytest.raises(ParameterError, match=reason):
        RigSettings(**settings)
