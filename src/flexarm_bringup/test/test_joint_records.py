"""What ``--joints`` is given: an encoder on every motor, positions as they were, torque that moves them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_arm import small_arm

from flexarm_bringup import cli
from flexarm_bringup.excite.rig_source import save_records
from flexarm_bringup.identify.joint_records import encoder_of_axes, motion_of, not_used, read_motion
from flexarm_bringup.identify.joints import CUTOFF
from flexarm_bringup.identify.measurement import COMMON, Records, SourceError
from flexarm_bringup.identify.slow_motion import move_rig
from flexarm_bringup.sim.rig import RigSettings
from flexarm_model.identification.joint_regression import identify_joints
from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

TWO_LINK = Path(__file__).parents[3] / "docs" / "two_link.yaml"
RATE_HZ, INERTIA = 200.0, 1.13  # of the small arm: hub, rotor and strip about the motor [kg m^2]


def record(**changes: Any) -> Records:
    """Return 15 s of the small arm, rigid, under two slow sines."""
    t = np.arange(0.0, 15.0, 1 / RATE_HZ)
    f = 2 * np.pi * np.array([[0.3], [0.7]])
    q = (0.4 / f * np.sin(f * t)).sum(axis=0)
    tau = INERTIA * (-0.4 * f * np.sin(f * (t + 0.5 / RATE_HZ))).sum(axis=0)
    return replace(
        Records(RATE_HZ, {"base.rz": tau}, {"encoder.position": q}, COMMON, is_held=True), **changes
    )


def said_of(
    records: Records, folder: Path, capsys: pytest.CaptureFixture[str], arm: Path | None = None
) -> tuple[int, str]:
    """Return exit code and page of a record in a file."""
    (path,) = save_records([records], folder / "record.npz")
    code = cli.main(["identify", str(path), "--joints", "--manipulator", str(arm or small_arm(folder))])
    told = capsys.readouterr()
    return code, told.out + told.err


def test_a_motor_whose_encoder_was_not_recorded_is_refused_by_name() -> None:
    """The arm behind it would count as locked at home: 81 % of the torque explained, all checks passed."""
    some = {axis: np.zeros(100) for axis in ("shoulder.rz", "elbow.rz")}
    records = Records(RATE_HZ, some, {"shoulder_encoder.position": np.zeros(100)}, COMMON)
    with pytest.raises(SourceError, match="motor elbow.rz was recorded: expected the output elbow_encoder"):
        motion_of(records, load_config(TWO_LINK))


def test_a_motor_without_encoder_is_refused_before_the_rig_moves(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    gauge = {"kind": "strain_gauge", "node": "strip.gauge", "offset": ["2 mm", "0 mm"], "sigma": "1 ustrain"}
    arm = small_arm(tmp_path, sensors={"gauge": gauge})
    assert cli.main(["identify", "rig", "--joints", "--manipulator", str(arm)]) == 2
    told = capsys.readouterr().err
    assert "small has no encoder on the motor base.rz" in told and "moving" not in told


def test_loops_are_refused_before_the_rig_is_built(capsys: pytest.CaptureFixture[str]) -> None:
    """The 3RRR was moved with its three motors apart until its loops did not close."""
    assert cli.main(["identify", "rig", "--joints", "--manipulator", "planar_3rrr"]) == 2
    told = capsys.readouterr().err
    assert "closed loops (hinge_2, hinge_3)" in told and "building" not in told


def test_of_two_encoders_on_an_axis_the_first_counts_and_the_other_is_named(tmp_path: Path) -> None:
    """Its torque would count twice."""
    encoder = {"kind": "encoder", "axis": "base.rz", "sigma": "20 urad"}
    config = load_config(small_arm(tmp_path, sensors__second=encoder))
    q = np.zeros(100)
    records = record(inputs={"base.rz": q}, outputs={"second.position": q + 1.0, "encoder.position": q})
    assert motion_of(records, config).axes == ("base.rz",) and not motion_of(records, config).q.any()
    assert not_used(config) == ["second is not used: encoder tells of base.rz"]
    assert encoder_of_axes(config, ["second.position"]) == {"base.rz": "second"}
    assert not not_used(config, ["second.position"])


@pytest.mark.parametrize("slow", [{"rate": "100 Hz"}, {"latency": "10 ms"}])
def test_an_encoder_that_is_slow_or_late_counts_by_its_stamps(slow: dict[str, str], tmp_path: Path) -> None:
    """A slow one ended in a KeyError; a late one made a viscous friction of -0.28 N m s/rad."""
    encoder = {"kind": "encoder", "axis": "base.rz", "sigma": "20 urad", **slow}
    config = load_config(small_arm(tmp_path, sensors={"encoder": encoder}))
    model = linearize(ReducedTree(config, use_compiler=False))
    motion = move_rig(config, model, RigSettings(), 6.0, lambda text: None)
    result = identify_joints(config, motion, CUTOFF * float(model.omega[0]) / (2 * np.pi))
    found = {p.name: p.value for p in result.parameters}
    assert found["rotor inertia"] == pytest.approx(0.1, abs=0.02)  # of 1.13 with the links
    assert found["viscous friction"] == pytest.approx(0.0, abs=0.1)  # 6 s do not tell more


def test_a_record_without_its_mean_is_refused(tmp_path: Path) -> None:
    """A modal test keeps positions so: weight was worked out at a pose that the arm never had."""
    (path,) = save_records([record(is_centred=True)], tmp_path / "modal.npz")
    with pytest.raises(SourceError, match="modal.npz: 'is_centred' is 1: its outputs are without their mean"):
        read_motion(path, load_config(small_arm(tmp_path)))


def test_a_record_of_a_moving_arm_passes_all_checks(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    code, told = said_of(record(), tmp_path, capsys)
    assert code == 0 and "excitation begins" not in told and "stands" not in told


def test_torque_that_does_not_explain_the_motion_fails_the_page(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A rotor of 0.187 for one of 0.3 was told from torque that came 0.1 s late, all checks passed."""
    good = record().inputs["base.rz"]
    code, told = said_of(record(inputs={"base.rz": np.roll(good, 30)}), tmp_path, capsys)
    assert code == 1 and "MISSED  torque explained, of motors that move" in told
    code, told = said_of(record(inputs={"base.rz": 0.0 * good}), tmp_path, capsys)
    assert code == 1 and "base.rz has no torque" in told


def test_an_arm_that_stands_fails_the_page(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    still = record(outputs={"encoder.position": 0.0 * record().outputs["encoder.position"]})
    code, told = said_of(still, tmp_path, capsys)
    assert code == 1 and "MISSED  motors that move" in told and "base.rz stands" in told


def test_an_excitation_above_the_regressions_band_and_a_sources_remarks_are_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    code, told = said_of(record(band_hz=(5.0, 40.0)), tmp_path, capsys)
    assert "its excitation begins at 5 Hz: --joints looks below 2.6" in told
    silent = record(remarks=("second.position is left out: it was silent",))
    monkeypatch.setattr("flexarm_bringup.identify.joints.read_motion", lambda path, config: silent)
    assert "second.position is left out: it was silent" in said_of(record(), tmp_path, capsys)[1]


def test_an_arm_without_motor_is_refused_as_such(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arm = small_arm(tmp_path, joints__base__axes__rz={"stiffness": "100 N m/rad"}, served__home=[])
    assert cli.main(["identify", "rig", "--joints", "--manipulator", str(arm)]) == 2
    assert "small has no motor: nothing moves its joints" in capsys.readouterr().err
