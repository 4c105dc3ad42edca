"""Arms, poses and records that cannot be identified are refused before anything moves, with the reason."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from small_arm import small_arm

from flexarm_bringup import cli
from flexarm_bringup.drift_run.drives_alone import drive_alone, slowest
from flexarm_bringup.excite.held_arm import HeldArm
from flexarm_bringup.excite.plan import Wish, plan_excitation
from flexarm_bringup.identify.slow_motion import slow_sines
from flexarm_bringup.sim.rig import Rig, RigSettings
from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

MOTOR = {"actuated": True, "rotor_inertia": "0.1 kg m^2", "effort": "5 N m", "effort_rate": "500 N m/s",
         "velocity": "5 rad/s"}  # fmt: skip
AT_ITS_END = {"joints__base__axes__rz": {**MOTOR, "lower": "0 deg", "upper": "100 deg"}}
NO_MOTOR = {"joints__base__axes__rz": {"stiffness": "100 N m/rad"}, "served__home": []}
CAMERA = {"cam": {"kind": "camera", "rate": "30 Hz", "sigma": "1 mm", "sigma_angle": "1 mrad"}}


def refusal(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    """Return what a command says when it refuses."""
    assert cli.main([str(word) for word in words]) == 2
    return capsys.readouterr().err


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"served__rate": "20 Hz"}, "13.24 Hz, lies above 7.812 Hz"),
        ({"served__modes": 0}, "serves no mode"),
        (AT_ITS_END, "nothing is left of range of base.rz"),
        ({"sensors__gauge__range": "0.001 ustrain", "sensors__gauge__sigma": "1e-4 ustrain",
          "gravity": ["0 m/s^2", "-1 m/s^2", "0 m/s^2"]},
         "nothing is left of range of gauge.strain"),
        (NO_MOTOR, "has no motor"),
        ({"sensors": CAMERA}, "no encoder, gauge or accelerometer"),
    ],
)  # fmt: skip
def test_a_modal_test_that_cannot_be_is_refused(
    changes: dict[str, Any], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arm = small_arm(tmp_path, **changes)
    assert said in refusal(capsys, "identify", "rig", "--manipulator", arm)


def test_who_keeps_joint_pd_from_holding_an_arm_that_falls_over_is_named(tmp_path: Path) -> None:
    """There are gains that hold it with less than 6 dB left; that there were none was said."""
    text = (Path(__file__).resolve().parents[3] / "docs" / "two_link.yaml").read_text(encoding="utf-8")
    described = yaml.safe_load(text)
    described["gravity"] = ["0 m/s^2", "-9.81 m/s^2", "0 m/s^2"]
    slide = {"actuated": True, "rotor_inertia": "2 kg", "effort": "200 N", "effort_rate": "20000 N/s",
             "velocity": "2 m/s", "lower": "-0.4 m", "upper": "0.4 m", "damping": "5 N s/m"}  # fmt: skip
    described["joints"]["shoulder"]["axes"] = {"ty": slide}
    described["sensors"]["shoulder_encoder"] |= {"axis": "shoulder.ty", "sigma": "10 um"}
    described["served"] |= {"home": ["0 m", "60 deg"], "poses": {}}
    path = tmp_path / "on_a_slide.yaml"
    path.write_text(yaml.safe_dump(described, sort_keys=False), encoding="utf-8")
    HeldArm(load_config(path))  # with a quarter of the damping; with a lighter motor there is none
    described["joints"]["elbow"]["axes"]["rz"]["rotor_inertia"] = "0.003 kg m^2"
    path.write_text(yaml.safe_dump(described, sort_keys=False), encoding="utf-8")
    with pytest.raises(ValueError, match="that bears twice its gains") as refused:
        HeldArm(load_config(path))
    assert "at [0.0, 1.047198]" in str(refused.value)
    assert "with more elbow.rz makes a mode of 28.4 Hz ring" in str(refused.value)


def test_a_pose_of_another_length_is_refused_by_axis(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arm = small_arm(tmp_path)
    said = refusal(capsys, "identify", "rig", "--manipulator", arm, "--pose", "1", "2")
    assert "2 values; expected one each for base.rz" in said


def test_a_channel_that_does_not_exist_is_refused_before_the_rig_moves(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = refusal(
        capsys, "identify", "rig", "--manipulator", small_arm(tmp_path), "--ignore-channel", "typo"
    )
    assert "typo: not one of encoder.position, gauge.strain" in said and "rig: building" not in said


def test_modes_that_sampling_mirrors_into_the_band_are_named(tmp_path: Path) -> None:
    """At 70 Hz the second mode, 82 Hz, shows at 12 Hz, beside the first at 13.2 Hz."""
    arm = HeldArm(load_config(small_arm(tmp_path, served__rate="70 Hz")))
    second = abs(arm.elastic_poles[1]) / (2 * np.pi)
    (told,) = plan_excitation(arm, Wish()).mirrored
    assert told == f"{second:.4g} Hz at {second - 70.0:.4g} Hz"
    assert not plan_excitation(HeldArm(load_config(small_arm(tmp_path))), Wish()).mirrored


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (AT_ITS_END, "base.rz: home at 0 leaves no room"),
        (NO_MOTOR, "has no motor"),
        ({"sensors": CAMERA}, "has no encoder"),
    ],
)
def test_joints_that_cannot_be_moved_or_seen_are_refused(
    changes: dict[str, Any], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arm = small_arm(tmp_path, **changes)
    assert said in refusal(capsys, "identify", "rig", "--joints", "--manipulator", arm)


def record(path: Path, spoilt: bool = False, **inputs: Any) -> Path:
    t = np.arange(3000) * 0.005
    q = 0.3 * np.sin(2 * np.pi * 0.3 * t) + 0.1 * np.sin(2 * np.pi * 0.7 * t)
    columns = {"t": t, "out:encoder.position": q, **inputs}
    if spoilt:
        columns["out:encoder.position"][100] = np.nan
    np.savez(path, **columns)
    return path


def acceleration() -> Any:
    t = np.arange(3000) * 0.005
    return sum(
        -size * (2 * np.pi * f) ** 2 * np.sin(2 * np.pi * f * t) for size, f in ((0.3, 0.3), (0.1, 0.7))
    )


def test_joints_without_the_torque_of_their_motor_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A rotor inertia of -0.06 kg m^2 was found instead, by a torque of nothing."""
    arm = small_arm(tmp_path)
    for given, there in (({}, "inputs: none"), ({"in:torque": acceleration()}, "inputs: torque")):
        path = record(tmp_path / "run.npz", **given)
        said = refusal(capsys, "identify", path, "--joints", "--manipulator", arm)
        assert "no torque of base.rz" in said and "'in:base.rz'" in said and there in said


def test_joints_from_positions_that_are_no_numbers_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = record(tmp_path / "run.npz", spoilt=True, **{"in:base.rz": acceleration()})
    said = refusal(capsys, "identify", path, "--joints", "--manipulator", small_arm(tmp_path))
    assert "of base.rz are not finite" in said


def test_an_inertia_below_zero_is_called_impossible(tmp_path: Path) -> None:
    """Hub and strip have 1.026 kg m^2, known to 2 %; the torque is that of 0.926."""
    torque, report = 0.926 * acceleration(), tmp_path / "joints.json"
    path = record(tmp_path / "run.npz", **{"in:base.rz": torque})
    arm = small_arm(tmp_path)
    words = ["identify", path, "--joints", "--manipulator", arm, "--json", report]
    assert cli.main([str(word) for word in words]) == 1
    rows = {row[1]: row for row in json.loads(report.read_text())["tables"][0]["rows"]}
    assert rows["rotor inertia"][-1] == "tells what cannot be" and rows["rotor inertia"][4] < 0.0


@pytest.mark.parametrize("modes", [0, 2])
def test_a_rigid_arm_is_moved_for_as_long_as_asked(modes: int, tmp_path: Path) -> None:
    config = load_config(small_arm(tmp_path, served__modes=modes))
    model = linearize(ReducedTree(config, use_compiler=False))
    rig, seen = Rig(config, RigSettings()), []
    reference = slow_sines(config, model, 1.0, rig.dt)
    drive_alone(rig, model, reference, 1.0, lambda rig, samples, tau: seen.append(rig.tick))
    assert len(seen) == round(1.0 / rig.dt)
    assert slowest(model, rig.dt) <= float(np.min(model.omega, initial=np.inf))


def test_units_of_a_sliding_axis_are_those_of_forces_and_masses(tmp_path: Path) -> None:
    slide = {"actuated": True, "rotor_inertia": "1 kg", "effort": "5 N", "effort_rate": "500 N/s",
             "velocity": "1 m/s", "lower": "-1 m", "upper": "1 m"}  # fmt: skip
    encoder = {"kind": "encoder", "axis": "base.ty", "sigma": "1 um"}
    arm = small_arm(
        tmp_path, joints__base__axes={"ty": slide}, sensors__encoder=encoder, served__home=["0 m"]
    )
    path, report = record(tmp_path / "run.npz", **{"in:base.ty": acceleration()}), tmp_path / "joints.json"
    cli.main([str(word) for word in ("identify", path, "--joints", "--manipulator", arm, "--json", report)])
    units = {row[1]: row[2] for row in json.loads(report.read_text())["tables"][0]["rows"]}
    assert units["rotor inertia"] == "kg" and units["viscous friction"] == "N s/m"
    assert units["Coulomb friction"] == units["offset"] == "N"


def test_a_drill_too_short_to_tell_a_change_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    said = refusal(capsys, "drift", "--simulate", small_arm(tmp_path), "--law", "alone", "--minutes", "0.1")
    assert "leaves 3 s to be told" in said


def test_a_bag_too_short_for_the_watch_is_refused_as_such(capsys: pytest.CaptureFixture[str]) -> None:
    """It holds 200 joint states after its model; none, it was said."""
    bag = Path(__file__).resolve().parents[3] / "tests" / "golden" / "single_link" / "bag"
    assert "1.00 s of joint_states after its model are too short" in refusal(capsys, "drift", bag)


@pytest.mark.parametrize(
    ("also", "said"),
    [("0.1,0.2={}", "pose has 2 values; expected 1"), ("3.1={}", "outside"), ("0.1={}x", "no such file")],
)
def test_another_pose_that_cannot_be_is_refused_before_the_rig_moves(
    also: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arm, path = small_arm(tmp_path), record(tmp_path / "run.npz")
    words = ["identify", "rig", "--manipulator", arm, "--also", also.format(path)]
    assert said in (told := refusal(capsys, *words)) and "rig: building" not in told


@pytest.mark.parametrize("command", [("rig",), ("sim",)])
def test_a_motor_without_effort_is_refused_before_anything_starts(
    command: tuple[str, ...], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Guard and controller ended with a traceback each, were started again, and the rig ended with 1."""
    motor = {key: value for key, value in MOTOR.items() if not key.startswith("effort")}
    arm = small_arm(tmp_path, joints__base__axes={"rz": motor})
    said = refusal(capsys, *command, arm)
    assert "joints.base.axes.rz.effort: is missing" in said and str(arm) in said
