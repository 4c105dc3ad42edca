"""The arm that a modal test holds: it stands still, and shakes as its encoders' noise has it shake."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from flexarm_bringup.excite.drive import Drive
from flexarm_bringup.excite.held_arm import DELAY, HeldArm, _limited_by
from flexarm_bringup.excite.measure import SensorCheckError, check_sensors, refuse
from flexarm_bringup.excite.plan import Wish, plan_excitation
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim.sensor_fault_text import parse_faults
from flexarm_controller.joint_loop import JointLoop
from flexarm_controller.joint_pd import JointPd
from flexarm_model.identification.channel_findings import Finding
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

ARMS = {
    "single_link": "geared",
    "planar_3rrr": "",
    "spatial_3tpt": "sim",
    "serial_6r": "",
    "variable_stiffness": "",
}


def held(name: str) -> HeldArm:
    return HeldArm(load_config(find_manipulator(name), ARMS[name]))


def checked(name: str, faults: str = "", believed: ManipulatorConfig | None = None) -> Sequence[Finding]:
    """Return what a sensor check finds on the simulated rig, which ``believed`` may not describe."""
    real = load_config(find_manipulator(name), ARMS[name])
    arm = HeldArm(believed or real)
    hardware = Hardware(real, RigSettings(), faults=parse_faults(faults, real.sensors))
    drive, steps = Drive(hardware, arm), check_sensors(arm, plan_excitation(arm, Wish()))
    added = next(steps)
    while True:
        try:
            added = steps.send(drive.run(added))
        except StopIteration as end:
            findings: Sequence[Finding] = end.value
            return findings


@pytest.mark.parametrize("name", ARMS)
def test_every_arm_is_held_with_margin(name: str) -> None:
    """The six-axis arm's wrist fell over in 15 s: its encoders were called swapped and of a wrong size."""
    arm = held(name)
    assert JointLoop(arm.model, arm.dt, DELAY).bears(arm._law.K_p, arm._law.K_d)


@pytest.mark.slow
@pytest.mark.parametrize("name", ARMS)
def test_sound_sensors_of_every_arm_are_good_or_not_moved(name: str) -> None:
    findings = checked(name)
    assert {f.verdict for f in findings} <= {"good", "not moved"}
    for f in findings:
        assert np.isnan(f.gain) or f.gain == pytest.approx(1.0, abs=0.1)
        assert f.noise == pytest.approx(f.described, rel=0.35)  # also where the hold shakes it most of all


@pytest.mark.slow
def test_a_flipped_gauge_of_the_six_axis_arm_is_named_and_no_other() -> None:
    findings = checked("serial_6r", "forearm_strain_y: wrong factor -1")
    assert {f.name: f.verdict for f in findings if f.verdict != "good"} == {
        "forearm_strain_y.strain": "flipped"
    }


@pytest.mark.parametrize("factor", [2.0, 0.5])
def test_a_gauge_whose_factor_is_off_by_two_is_of_a_wrong_size_and_no_other(factor: float) -> None:
    findings = checked("single_link", f"root_strain: wrong factor {factor}")
    assert [f.verdict for f in findings] == ["good", "wrong size", "good"]
    assert findings[1].gain == pytest.approx(factor, rel=0.02)  # the loop is predicted with its delays


def test_the_description_of_another_preset_is_told_as_that_and_no_sensor_is_to_be_repaired() -> None:
    findings = checked("single_link", believed=load_config(find_manipulator("single_link"), "light_hub"))
    assert {f.verdict for f in findings} == {"another arm"}
    with pytest.raises(SensorCheckError, match=r"whole arm answers .* preset.* No sensor is to blame"):
        refuse(tuple(findings), {f.name for f in findings}, ("base.rz",))


@pytest.mark.slow
def test_gravity_that_the_description_lacks_is_told_by_an_accelerometer_at_rest() -> None:
    real = load_config(find_manipulator("variable_stiffness"), "")
    findings = checked("variable_stiffness", believed=replace(real, gravity=np.zeros(3)))
    refused = {f.name: f.words for f in findings if f.is_refused}
    assert list(refused) == ["forearm_accelerometer.x"]
    assert "gravity in the description" in refused["forearm_accelerometer.x"]


def test_the_noise_of_encoders_shakes_an_accelerometer() -> None:
    """At 1 kHz ten times as much as its own noise."""
    arm = held("spatial_3tpt")
    y = arm.shaken(1500)[500:]
    row = arm.model.outputs.names.index("tool_accelerometer.x")
    assert 0.1 < y[:, row].std() < 1.0
    np.testing.assert_array_equal(y, arm.shaken(1500)[500:])


def test_an_arm_too_heavy_for_the_firmest_joint_pd_is_told_from_one_that_rings() -> None:
    two = np.ones(2)
    law = cast(JointPd, SimpleNamespace(wanted=two, gains=lambda frequency: (frequency, frequency)))
    for f_hz, said in ((0.0, "also with the most gain"), (22.4, "with more b makes a mode of 22.4 Hz ring")):
        loop = SimpleNamespace(ringing_hz=lambda K_p, K_d, f=f_hz: f, culprit=lambda K_p, K_d: 1)
        assert said in _limited_by(cast(JointLoop, loop), law, ("a", "b"))
