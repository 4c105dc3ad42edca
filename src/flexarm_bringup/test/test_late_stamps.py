"""Sensors whose driver stamps late: what the estimator moves back is where the rig took the sample."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexarm_bringup.closed_loop import measurements
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import Rig, RigSettings
from flexarm_estimator.watches.stamp_delays import StampDelays
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

SPEED = 3.0  # rad/s


def arm(delay: float) -> ManipulatorConfig:
    """Return the single link; encoder and gauge are stamped late [s], the camera by 60 ms more."""
    config = load_config(find_manipulator("single_link"))
    kinds = {"encoder": delay, "strain_gauge": delay, "camera": delay + 0.06}
    specs = (replace(spec, stamp_delay=kinds.get(spec.kind, 0.0)) for spec in config.sensors)
    return replace(config, sensors=tuple(specs))


@pytest.mark.parametrize("delay", [0.002, 0.0024, -0.0013, 0.005])
def test_a_moving_arm_is_measured_where_it_is_at_the_instant_that_is_told(delay: float) -> None:
    """At 200 Hz 2 ms became none on the rig, and an encoder at 3 rad/s was told 6 mrad off."""
    config = arm(delay)
    hardware = Hardware(config, RigSettings(noise=0.0))
    rig, undo = hardware.rig, StampDelays(config.sensors).undo
    rig.plant.v[rig.plant.tree.actuated] = SPEED
    samples, heard = rig.observe(), []
    truth = {0.0: float(rig.plant.theta[0])}
    for _ in range(60):
        heard += undo(measurements(samples, hardware))
        samples = rig.servo(np.zeros(1))
        truth[round(rig.time_of(rig.tick), 9)] = float(rig.plant.theta[0])
    assert {each.sensor for each in heard} == {spec.name for spec in config.sensors}
    for each in heard:
        assert round(each.t, 9) in truth  # taken at a tick
        if each.sensor == "encoder":
            assert each.y[0] == pytest.approx(truth[round(each.t, 9)], abs=1e-9)


def test_delays_of_whole_periods_and_none_say_the_same_at_other_stamps() -> None:
    late, prompt = (Rig(arm(delay)) for delay in (0.01, 0.0))
    for _ in range(30):
        for a, b in zip(late.rest(), prompt.rest(), strict=True):
            assert a.late_ns == b.late_ns == 0
            assert (a.y == b.y).all()
            assert a.tick - b.tick == (2 if a.kind in ("encoder", "strain_gauge", "camera") else 0)
