"""A sensor that would measure nothing for ever is refused with file, key, value and what is allowed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from arms import FOLDER
from descriptions import refusal, write_arm
from fe_bodies import bracket, load_arm

from flexarm_model.bodies.sid_file import write_sid
from flexarm_model.manipulator.imu import imus
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

ARM = FOLDER.parents[3] / "docs/two_link.yaml"
GAUGE = {"kind": "strain_gauge", "offset": ["2 mm", "0 mm"], "sigma": "1 ustrain"}
IMU = {"kind": "accelerometer", "axes": ["y"], "sigma": "0.03 m/s^2", "range": "50 g"}
HUB = {"type": "rigid", "mass": "1 kg", "inertia": [*["1 kg m^2"] * 3, *["0 kg m^2"] * 3]}


def write(folder: Path, sensor: dict[str, Any], **forearm: Any) -> Path:
    """Write the arm with rigid ends on its forearm, a pedestal, and the sensor."""
    content = yaml.safe_load(ARM.read_text(encoding="utf-8"))
    beam = content["bodies"]["forearm"]
    ends = [{"length": "20 mm", "rigid": True}, {"length": "30 mm", "rigid": True}]
    beam["pieces"] = [ends[0], *beam["pieces"], ends[1]]
    beam["nodes"] = {
        "gauge": "10 mm",
        "inner": "20 mm",
        "middle": "100 mm",
        "outer": "320 mm",
        "tip": "350 mm",
    }
    beam.update(forearm)
    bodies = {"pedestal": {**HUB, "nodes": {"top": ["0 mm", "0 mm", "1 m"]}}, **content["bodies"]}
    content["joints"]["shoulder"]["parent"] = "pedestal.top"
    foot = {"parent": "world", "child": "pedestal.root"}
    sensors = {"encoder": content["sensors"]["shoulder_encoder"], "sensor": sensor}
    content.update(bodies=bodies, joints={"foot": foot, **content["joints"]}, sensors=sensors)
    return write_arm(folder, content)


@pytest.mark.parametrize("node", ["forearm.root", "forearm.gauge", "forearm.outer", "forearm.tip"])
def test_a_gauge_on_a_rigid_piece_of_a_beam_is_refused(tmp_path: Path, node: str) -> None:
    message = refusal(path := write(tmp_path, {**GAUGE, "node": node}))
    assert message.startswith(f"{path}: sensors.sensor.node: '{node}': lies on a rigid piece")
    assert message.endswith("a gauge needs a flexible place: from 0.02 m to below 0.32 m")


@pytest.mark.parametrize("node", ["forearm.inner", "forearm.middle", "upper.root", "upper.gauge"])
def test_a_gauge_on_a_flexible_piece_is_read_and_measures(tmp_path: Path, node: str) -> None:
    model = linearize(ReducedTree(load_config(write(tmp_path, {**GAUGE, "node": node})), use_compiler=False))
    assert abs(model.outputs.C_pos[1, 2:]).max() > 1e-3  # strain per mode; the whole beam reaches 1e-2


def test_every_refused_place_reads_zero_where_the_check_is_passed_by(tmp_path: Path) -> None:
    """The check agrees with the mesh: a node at the seam belongs to the piece behind it."""
    config = load_config(write(tmp_path, {**GAUGE, "node": "forearm.middle"}))
    strain = {
        name: abs(shape.strain).max()
        for name, shape in ReducedTree(config, use_compiler=False).bodies["forearm"].nodes.items()
    }
    for name, value in strain.items():
        assert (value > 1e-3) == (name in ("inner", "middle")), (name, value)


@pytest.mark.parametrize("node", ["world", "pedestal.top", "elbow_motor.root"])
def test_a_gauge_on_what_has_no_strain_is_refused(tmp_path: Path, node: str) -> None:
    message = refusal(write(tmp_path, {**GAUGE, "node": node}))
    assert f"sensors.sensor.node: '{node}': no strain is known" in message
    assert message.endswith("expected a flexible place of a beam (upper, forearm)")


@pytest.mark.parametrize(
    ("deformation", "offset", "strains"),
    [
        (["bend_y"], ["2 mm", "0 mm"], True),
        (["bend_y"], ["0 mm", "2 mm"], False),
        (["bend_z"], ["2 mm", "0 mm"], False),
        (["bend_y", "torsion"], ["0 mm", "0 mm"], False),
        (["bend_y", "stretch"], ["0 mm", "0 mm"], True),
    ],
)
def test_a_gauge_on_the_neutral_axis_is_refused(
    tmp_path: Path, deformation: list[str], offset: list[str], strains: bool
) -> None:
    reduction = {"method": "craig_bampton", "modes": 3}
    gauge = {**GAUGE, "node": "forearm.middle", "offset": offset}
    path = write(tmp_path, gauge, deformation=deformation, reduction=reduction)
    if strains:
        load_config(path)
    else:
        assert f"sensors.sensor.offset: {offset}: nothing strains there: 'forearm'" in refusal(path)


SECTIONS = {
    "rectangle": {"shape": "rectangle", "along_y": "4 mm", "along_z": "30 mm"},
    "box": {"shape": "box", "along_y": "4 mm", "along_z": "30 mm", "wall": "0.5 mm"},
    "tube": {"shape": "tube", "outer_diameter": "30 mm"},
    "given": {"shape": "given", "area": "100 mm^2", **dict.fromkeys(("I_y", "I_z"), "160 mm^4"),
              "torsion_constant": "160 mm^4"},
}  # fmt: skip


@pytest.mark.parametrize(
    ("shape", "offset", "side"),
    [
        ("rectangle", ["2 mm", "15 mm"], ""),
        ("rectangle", ["-3.1 mm", "0 mm"], ""),  # on a carrier
        ("rectangle", ["250 mm", "0 mm"], "0.25 m from the axis along y, outside of 'forearm', whose section "
         "is 0.004 m along y there; expected at most half of that"),
        ("rectangle", ["2 mm", "-18 mm"], "is 0.03 m along z"),
        ("box", ["4 mm", "0 mm"], "is 0.004 m along y"),
        ("tube", ["16 mm", "0 mm"], ""),
        ("tube", ["18 mm", "0 mm"], "is 0.03 m along y"),
        ("given", ["250 mm", "0 mm"], ""),
    ],
)  # fmt: skip
def test_a_gauge_outside_of_its_beam_is_refused(
    tmp_path: Path, shape: str, offset: list[str], side: str
) -> None:
    path = write(tmp_path, {**GAUGE, "node": "forearm.middle", "offset": offset})
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    content["bodies"]["forearm"]["pieces"][1]["section"] = SECTIONS[shape]
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    if side:
        message = refusal(path)
        assert message.startswith(f"{path}: sensors.sensor.offset: {offset}: ") and side in message
    else:
        load_config(path)


def test_a_gauge_at_a_seam_is_judged_by_the_section_behind_it(tmp_path: Path) -> None:
    for inner, outer, fits in (("12 mm", "4 mm", False), ("4 mm", "12 mm", True)):
        path = write(tmp_path, {**GAUGE, "node": "forearm.middle", "offset": ["6 mm", "0 mm"]})
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
        hub, piece, tip = content["bodies"]["forearm"]["pieces"]
        thick = [{**piece, "length": length, "section": {**SECTIONS["rectangle"], "along_y": along_y}}
                 for length, along_y in (("80 mm", inner), ("220 mm", outer))]  # fmt: skip
        content["bodies"]["forearm"]["pieces"] = [hub, *thick, tip]
        path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
        if fits:
            load_config(path)
        else:
            assert "is 0.004 m along y there" in refusal(path)


@pytest.mark.parametrize("node", ["world", "pedestal.root", "pedestal.top"])
def test_an_accelerometer_that_never_moves_is_refused(tmp_path: Path, node: str) -> None:
    message = refusal(path := write(tmp_path, {**IMU, "node": node}))
    assert message.startswith(f"{path}: sensors.sensor.node: '{node}': never moves")


@pytest.mark.parametrize("node", ["world", "pedestal.root", "pedestal.top"])
def test_a_tip_that_never_moves_is_refused_whoever_watches_it(tmp_path: Path, node: str) -> None:
    camera = {"kind": "camera", "axes": ["tx", "ty", "tz"], "sigma": "1 mm"}
    for sensor in (camera, {**IMU, "node": "forearm.tip"}):
        path = write(tmp_path, sensor)
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
        path.write_text(yaml.safe_dump({**content, "tip": node}, sort_keys=False), encoding="utf-8")
        message = refusal(path)
        assert message.startswith(f"{path}: tip: '{node}': never moves")
        assert message.endswith("expected a node that does")


@pytest.mark.parametrize("node", ["upper.root", "elbow_motor.root", "forearm.tip"])
def test_an_accelerometer_on_the_arm_is_read(tmp_path: Path, node: str) -> None:
    load_config(write(tmp_path, {**IMU, "node": node}))


def test_the_root_of_a_beam_that_is_clamped_to_the_world_never_moves_and_its_end_does(tmp_path: Path) -> None:
    for node, stands in (("upper.root", True), ("upper.gauge", False), ("elbow_motor.root", False)):
        path = write(tmp_path, {**IMU, "node": node})
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
        del content["joints"]["shoulder"]["axes"]
        content["sensors"]["encoder"]["axis"] = "elbow.rz"
        content["served"] = {"modes": 4, "home": ["60 deg"], "rate": "200 Hz"}
        path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
        if stands:
            assert f"sensors.sensor.node: '{node}': never moves" in refusal(path)
        else:
            load_config(path)


def test_a_gauge_on_a_body_from_a_file_needs_strain_in_the_file(tmp_path: Path) -> None:
    config = load_config(write(tmp_path, {**GAUGE, "node": "forearm.middle"}))
    body = ReducedTree(config, use_compiler=False).bodies["forearm"]
    write_sid(body, tmp_path / "whole.sid")
    part = (tmp_path / "whole.sid").read_text(encoding="utf-8").partition("\nflexarm\n")[0]
    (tmp_path / "standard.sid").write_text(part + "\n", encoding="utf-8")
    for file, node, strains in (
        ("whole", "middle", True),
        ("whole", "tip", False),
        ("standard", "middle", False),
    ):
        path = write(tmp_path, {**GAUGE, "node": f"forearm.{node}"})
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
        content["bodies"]["forearm"] = {"type": "superelement", "file": f"{file}.sid"}
        path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
        if strains:
            model = linearize(ReducedTree(load_config(path), use_compiler=False))
            assert np.isfinite(model.outputs.C_pos[1]).all()
        else:
            assert f"sensors.sensor.node: 'forearm.{node}': no strain is known" in refusal(path)


def test_a_gauge_on_an_imported_body_is_refused(tmp_path: Path) -> None:
    config = load_arm(tmp_path, bracket())
    path = tmp_path / "arm.yaml"
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    content["sensors"] = {"sensor": {**GAUGE, "node": "solid.end"}}
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    assert "sensors.sensor.node: 'solid.end': no strain is known" in refusal(path)
    spec = SensorSpec(
        "sensor", "strain_gauge", "solid.end", ("strain",), np.array([1e-6]), offset=(1e-3, 0.0)
    )
    with pytest.raises(ValueError, match="sensor 'sensor': no strain is known at 'solid.end'"):
        linearize(ReducedTree(replace(config, sensors=(spec,)), use_compiler=False))


def write_unit(folder: Path, **changes: Any) -> Path:
    """Write an arm whose accelerometer and gyroscope share the unit of the former."""
    path = write(folder, {**IMU, "node": "forearm.tip"})
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    rate = {"kind": "gyroscope", "node": "forearm.tip", "axes": ["z"], "sigma": "0.1 deg/s", "imu": "sensor"}
    content["sensors"]["rate"] = {**rate, "range": "2000 deg/s", **changes}
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return path


def test_a_gyroscope_may_share_the_unit_of_an_accelerometer(tmp_path: Path) -> None:
    config = load_config(write_unit(tmp_path, bias={"sigma": "1 deg/s", "drift": "0.01 deg/s/sqrt(s)",
                                                     "limit": "5 deg/s", "rate": "0.1 deg/s/s"}))  # fmt: skip
    assert {unit: [spec.name for spec in specs] for unit, specs in imus(config.sensors).items()} == {
        "sensor": ["sensor", "rate"]
    }
    rate = config.sensors[-1]
    assert rate.sigma == pytest.approx(np.radians([0.1])) and rate.high == pytest.approx(np.radians(2000))
    assert rate.bias is not None and rate.bias.rate == pytest.approx(np.radians(0.1))


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"node": "forearm.middle"}, "sits at 'forearm.tip' with 'sensor', not at 'forearm.middle'"),
        ({"kind": "accelerometer", "sigma": "1 m/s^2", "range": "1 g"}, "has accelerometer 'sensor' already"),
        ({"imu": "tip unit"}, "expected a name that a topic may bear"),
        ({"imu": "über"}, "expected a name that a topic may bear"),
        ({"imu": "2nd"}, "expected a name that a topic may bear"),
    ],
)
def test_a_unit_that_cannot_be_is_refused(tmp_path: Path, changes: dict[str, str], words: str) -> None:
    message = refusal(path := write_unit(tmp_path, **changes))
    assert message.startswith(f"{path}: sensors.rate.imu: '{changes.get('imu', 'sensor')}': ")
    assert words in message


@pytest.mark.parametrize(
    ("sensor", "changes", "reach"),
    [
        ({**GAUGE, "node": "forearm.middle"}, {"sigma": "100 ustrain", "range": "50 ustrain"}, "5e-05 m/m"),
        ({**GAUGE, "node": "forearm.middle"}, {"sigma": "0.03 m/m"}, "0.02 m/m"),  # beside the usual range
        ({**IMU, "node": "forearm.tip"}, {"sigma": "3 m/s^2", "range": "3 m/s^2"}, "3 m/s^2"),
        ({"kind": "encoder", "axis": "elbow.rz"}, {"sigma": "20 rad"}, "3.21799 rad"),
    ],
)
def test_noise_that_fills_the_range_is_refused(
    tmp_path: Path, sensor: dict[str, Any], changes: dict[str, str], reach: str
) -> None:
    message = refusal(path := write(tmp_path, {**sensor, **changes}))
    assert message.startswith(
        f"{path}: sensors.sensor.sigma: '{changes['sigma']}': must be below the range, "
    )
    assert f"{reach}: nothing but noise" in message


def test_a_gyroscope_that_never_turns_is_refused(tmp_path: Path) -> None:
    assert "never moves" in refusal(write_unit(tmp_path, node="pedestal.top", imu="own"))
