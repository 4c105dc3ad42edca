"""Bytes of a tick are read as the messages that they stand for, whatever is wrong with the sensors."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
serialization = pytest.importorskip("rclpy.serialization", reason="needs ROS")
pytest.importorskip("flexarm_bringup.conversions", reason="needs ROS and flexarm_interfaces")

from sensor_msgs.msg import JointState  # noqa: E402

from flexarm_bringup.bags.bag_reader import Record, decode  # noqa: E402
from flexarm_bringup.sim.conversions import joint_state_msg, samples_to_msgs  # noqa: E402
from flexarm_bringup.sim.drives import Drives  # noqa: E402
from flexarm_bringup.sim.sensor_fault_text import parse_faults  # noqa: E402
from flexarm_bringup.sim.tick_writer import TickWriter  # noqa: E402
from flexarm_controller.drives.conversions import drive_state_msg  # noqa: E402
from flexarm_estimator.messages.sensor_messages import SensorReader  # noqa: E402
from flexarm_model.manipulator.description import ManipulatorConfig  # noqa: E402
from flexarm_model.manipulator.imu import INERTIAL  # noqa: E402
from flexarm_model.manipulator.sensor_spec import SensorSpec  # noqa: E402
from flexarm_model.reading.config import load_config  # noqa: E402
from flexarm_model.reading.manipulator_file import find_manipulator  # noqa: E402

EPOCH_NS, TICKS = 1_700_000_000_000_000_000, 80
FAULTS = {
    "single_link": "encoder: off 0.1 0.2; root_strain: bias 1e-5; camera: delayed 20 ms",
    "planar_3rrr": "",
}


def is_same(written: Any, msg: Any) -> bool:
    """Compare in words, which takes care of numbers that are none; bytes must be a message and no more."""
    if not isinstance(written, bytes):
        return str(written) == str(msg)
    kind = type(msg)
    name = f"{kind.__module__.split('.')[0]}/msg/{kind.__name__}"
    decode(Record(name, name, 0, written))  # as a bag is read
    return str(serialization.deserialize_message(written, kind)) == str(msg)


def described(arm: str) -> ManipulatorConfig:
    """Return an arm whose first accelerometer shares its unit with a gyroscope, and with bridged gauges."""
    config = load_config(find_manipulator(arm))
    felt = next(spec for spec in config.sensors if spec.kind == "accelerometer")
    rate = SensorSpec("rate", "gyroscope", felt.site, ("y", "z"), np.full(2, 1e-3), imu=felt.name)
    sensors = [replace(s, output=-1.025) if s.kind == "strain_gauge" else s for s in config.sensors]
    return replace(config, sensors=(*sensors, rate))


@pytest.mark.parametrize("arm", FAULTS)
def test_bytes_of_a_tick_are_its_messages(arm: str) -> None:
    config = described(arm)
    drives = Drives(config, faults=parse_faults(FAULTS[arm], config.sensors))
    writes: list[type] = []

    def serialise(msg: object) -> bytes:
        writes.append(type(msg))
        return bytes(serialization.serialize_message(msg))

    def stamp_of(tick: int) -> int:
        return EPOCH_NS + tick * drives.rig.period_ns

    reader = SensorReader(config)
    writer, rng, axes = TickWriter(config, drives, serialise), np.random.default_rng(1), set[int]()
    samples = drives.observe()
    drives.is_released = True
    for tick in range(TICKS):
        now_ns, state = stamp_of(tick), drives.state()
        told, written = samples_to_msgs(config, samples, stamp_of), writer.sensors(samples, stamp_of)
        read = {(s.sensor, *s.y) for out in told for s in reader.read(out.topic, out.msg, 0.0).samples}
        assert read >= {(s.sensor, *s.y) for s in samples if s.kind in INERTIAL}
        assert [out.topic for out in told] == [out.topic for out in written]
        assert all(is_same(a.msg, b.msg) for a, b in zip(written, told, strict=True))
        joints = joint_state_msg(drives, now_ns)
        axes.add(len(joints.name))
        assert is_same(writer.joint_states(now_ns), joints)
        drive_states = drive_state_msg(drives.names, state, drives.acted, now_ns)
        assert is_same(writer.drive_states(now_ns), drive_states)
        drives.tau = [float(each) for each in rng.normal(scale=0.01, size=len(drives.names))]
        samples = drives.advance()
    assert len(axes) == 1 + bool(FAULTS[arm])  # silent encoders leave axes out
    assert writes.count(JointState) < 5  # all others were written without rclpy
