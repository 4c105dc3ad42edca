"""What sees only part of the tip's pose: a laser tracker, a camera above a plane."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from flexarm_bringup.closed_loop import measurements, run_loop
from flexarm_bringup.sim.conversions import UNSEEN, sample_msg
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim.sample import Sample
from flexarm_bringup.sim.sensor_fault_text import parse_faults
from flexarm_bringup.sim.sensor_faults import Arrival, FaultLine, SensorFault
from flexarm_bringup.sim_run.study import loop_settings
from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.course import plan_course
from flexarm_bringup.tasks.task_for import task_for
from flexarm_bringup.topics import streams
from flexarm_estimator.estimate import Estimate
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.messages.sensor_messages import SensorReader
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.manipulator.cameras import cameras
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.settings.strict_yaml import ConfigError
from flexarm_model.tree.reduced_tree import ReducedTree

CAMERA = "{kind: camera, rate: 30 Hz, latency: 60 ms, sigma: 0.5 mm, sigma_angle: 5 mrad}"
TRACKER = "{kind: camera, axes: [tx, ty, tz], rate: 100 Hz, latency: 10 ms, sigma: 0.05 mm}"
ABOVE = "{kind: camera, axes: [ty, tx], rate: 30 Hz, latency: 60 ms, sigma: 0.5 mm}"
HALF = (
    "{kind: camera, axes: [tx, rx, ry, rz], rate: 30 Hz, latency: 60 ms, sigma: 0.5 mm, sigma_angle: 5 mrad}"
)


def arm(folder: Path, camera: str) -> ManipulatorConfig:
    text = find_manipulator("single_link").read_text()
    assert CAMERA in text
    path = folder / "arm.yaml"
    path.write_text(text.replace(CAMERA, camera))
    return load_config(path, "geared")


@pytest.mark.parametrize(
    ("camera", "message"),
    [
        ("{kind: camera, axes: [rx, ry, rz], sigma: 1 mm, sigma_angle: 1 mrad}", "some of tx, ty, tz"),
        ("{kind: camera, axes: [tx, rz], sigma: 1 mm, sigma_angle: 1 mrad}", "rx, ry, rz all together"),
        ("{kind: camera, axes: [tx, x], sigma: 1 mm}", "expected some of tx, ty, tz, rx, ry, rz"),
        ("{kind: camera, axes: [], sigma: 1 mm}", "at least 1 of"),
        ("{kind: camera, axes: [tx], sigma: 1 mm, sigma_angle: 1 mrad}", "sigma_angle"),
        ("{kind: camera, sigma: 1 mm}", "sigma_angle"),
    ],
)
def test_a_pose_that_cannot_be_seen_so_is_refused(tmp_path: Path, camera: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message) as refused:
        arm(tmp_path, camera)
    assert "arm.yaml" in str(refused.value) and "camera" in str(refused.value)


@pytest.mark.parametrize("camera", [TRACKER, ABOVE, HALF])
def test_rows_are_those_of_the_whole_pose(tmp_path: Path, camera: str) -> None:
    whole, part = (arm(tmp_path, text) for text in (CAMERA, camera))
    spec = next(spec for spec in part.sensors if spec.kind == "camera")
    rows = [("tx", "ty", "tz", "rx", "ry", "rz").index(channel) for channel in spec.channels]
    models = []
    for config in (whole, part):
        tree = ReducedTree(config)
        model = linearize(tree)
        parts = Estimator(model, tree, config.sensors, EstimatorConfig()).past[0]
        models.append(parts.sensors.poses["camera"])
    assert [name for name in model.outputs.names if name.startswith("camera")] == [
        f"camera.{channel}" for channel in spec.channels
    ]
    x, y = np.linspace(-0.02, 0.03, len(parts.process.P0)), np.array([0.5, 0.1, 0.0, 0.02, 0.01, 0.3])
    (nu, H), (nu_part, H_part) = (
        model.linearise(said, x, np.zeros(2)) for model, said in zip(models, (y, y[rows]), strict=True)
    )
    np.testing.assert_array_equal(H_part, H[rows])
    np.testing.assert_allclose(nu_part, nu[rows], rtol=0, atol=1e-15)
    np.testing.assert_allclose(nu_part, models[1].innovation(y[rows], x, np.zeros(2)), rtol=0, atol=1e-15)


@pytest.mark.parametrize("camera", [CAMERA, TRACKER, ABOVE, HALF])
def test_a_message_says_what_the_sensor_saw(tmp_path: Path, camera: str) -> None:
    config = arm(tmp_path, camera)
    spec = next(spec for spec in config.sensors if spec.kind == "camera")
    said = np.linspace(0.1, 0.5, len(spec.channels))
    msg = sample_msg(spec, Sample("camera", "camera", 3, said), 15_000_000).msg
    assert (np.diag(np.reshape(msg.pose.covariance, (6, 6))) == UNSEEN).sum() == 6 - len(spec.channels)
    (read,) = SensorReader(config).read("camera/pose", msg, 0.015).samples
    np.testing.assert_allclose(read.y, said, rtol=0, atol=1e-12)
    assert read.R is None
    msg.pose.covariance = (4.0 * np.reshape(msg.pose.covariance, (6, 6))).ravel()
    (read,) = SensorReader(config).read("camera/pose", msg, 0.015).samples
    np.testing.assert_allclose(np.diag(read.R), 4.0 * spec.sigma**2)


def test_where_no_rotation_is_seen_the_quaternion_may_be_anything(tmp_path: Path) -> None:
    config = arm(tmp_path, TRACKER)
    spec = next(spec for spec in config.sensors if spec.kind == "camera")
    msg = sample_msg(spec, Sample("camera", "camera", 3, np.ones(3)), 15_000_000).msg
    orientation = msg.pose.pose.orientation
    for number in (0.0, float("nan"), 1e300):
        orientation.x = orientation.y = orientation.z = orientation.w = number
        assert len(SensorReader(config).read("camera/pose", msg, 0.015).samples) == 1


def run(config: ManipulatorConfig, fault: str = "") -> tuple[np.ndarray, Estimate]:
    """Return how far the estimate of the tip is off in a move [m], (k,), and the last estimate."""
    task, found, told = task_for("single_link"), [], []
    tree = ReducedTree(config)
    course = plan_course(StaticArm(tree), task, 1 / config.rate_hz)
    settings = loop_settings(task, "mpc", RigSettings())
    hardware = Hardware(config, settings.rig, faults=parse_faults(fault, config.sensors))

    def look(hardware: Hardware, estimate: Estimate) -> Mapping[str, np.ndarray]:
        told.append(estimate)
        if hardware.t > 0.6:
            error = estimate.T_world_tip[:3, 3] - hardware.rig.plant.tip_pose()[:3, 3]
            found.append(float(np.linalg.norm(error)))
        return {}

    run_loop(hardware, tree, course.reference, 2.5, settings, look)
    return np.array(found), told[-1]


def test_a_tracker_leads_where_the_encoder_is_silent(tmp_path: Path) -> None:
    """Its position alone locates the axis; the camera in its place is ten times noisier, six times later."""
    fault = "encoder: off 0.6 2.5"
    by_camera, _ = run(arm(tmp_path, CAMERA), fault)
    by_tracker, last = run(arm(tmp_path, TRACKER), fault)
    assert np.sqrt(np.mean(by_tracker**2)) < 0.6 * np.sqrt(np.mean(by_camera**2))
    assert last.status in ("ok", "degraded")


@pytest.mark.parametrize("camera", [ABOVE, HALF])
def test_part_of_a_pose_is_fused_without_complaint(tmp_path: Path, camera: str) -> None:
    errors, last = run(arm(tmp_path, camera))
    assert errors.max() < 2e-3 and last.status == "ok"
    report = next(report for report in last.sensors if report.name == "camera")
    assert report.accepted > 50 and not report.rejected


def test_a_wrong_unit_reaches_places_and_not_turns(tmp_path: Path) -> None:
    spec = next(spec for spec in arm(tmp_path, HALF).sensors if spec.kind == "camera")
    line = FaultLine(SensorFault("wrong", factor=1000.0), spec, 0.005, 1)
    (arrival,) = line.carry(Arrival(12, Sample("camera", "camera", 0, np.full(4, 0.1))))
    np.testing.assert_allclose(arrival.sample.y, [100.0, 0.1, 0.1, 0.1])


TWO = CAMERA + "\n  tracker: " + TRACKER.replace("camera,", "camera, topic: tracker,")


def test_two_look_at_the_tip_each_on_a_topic_of_its_own(tmp_path: Path) -> None:
    config = arm(tmp_path, TWO)
    reader = SensorReader(config)
    assert {"camera/pose", "camera/tracker"} <= set(reader.topics)
    for spec in config.sensors[-2:]:
        said = Sample(spec.name, "camera", 3, np.full(len(spec.channels), 0.1))
        written = sample_msg(spec, said, 15_000_000)
        (read,) = reader.read(written.topic, written.msg, 0.015).samples
        assert read.sensor == spec.name and read.R is None
    told = {s.topic for s in streams((), cameras(config.sensors)) if s.topic.startswith("camera")}
    assert told == {"camera/pose", "camera/tracker"}


@pytest.mark.parametrize(
    ("second", "message"),
    [
        (TRACKER, "is the topic of 'camera' already"),
        (TRACKER.replace("camera,", "camera, topic: a b,"), "a name that a topic may bear"),
    ],
)
def test_two_on_one_topic_are_refused(tmp_path: Path, second: str, message: str) -> None:
    """The second would never be heard, and the first be told what the second saw."""
    with pytest.raises(ConfigError, match=message) as refused:
        arm(tmp_path, CAMERA + "\n  tracker: " + second)
    assert "arm.yaml" in str(refused.value) and "sensors.tracker.topic" in str(refused.value)


def test_two_know_the_tip_better_than_one(tmp_path: Path) -> None:
    fault = "encoder: off 0.6 2.5"
    one, _ = run(arm(tmp_path, CAMERA), fault)
    two, last = run(arm(tmp_path, TWO), fault)
    assert np.sqrt(np.mean(two**2)) < 0.6 * np.sqrt(np.mean(one**2))
    assert not any(report.rejected for report in last.sensors)


def test_at_rest_nobody_is_told_to_stamp_late(tmp_path: Path) -> None:
    """The tracker sees less noise than encoder and gauge predict."""
    config = arm(tmp_path, TWO)
    tree = ReducedTree(config)
    settings = loop_settings(task_for("single_link"), "mpc", RigSettings())
    estimator, hardware = (
        Estimator(linearize(tree), tree, config.sensors, settings.estimator),
        Hardware(config),
    )
    samples, said = hardware.observe(), set()
    for _ in range(1600):
        told = estimator.step(measurements(samples, hardware), np.array(hardware.acted), hardware.t)
        said |= {report.reason for report in told.sensors if report.reason and report.accepted}
        samples = hardware.advance()
        hardware.choose_torque(None)
    assert not said
    assert "stamp delay found [s]" not in estimator.figures()["tracker"]
