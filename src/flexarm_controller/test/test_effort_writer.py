"""Torques written as bytes carry a seal that the drives open, and what they carry is what was sealed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytestmark = pytest.mark.ros
serialization = pytest.importorskip("rclpy.serialization", reason="needs ROS")
pytest.importorskip("flexarm_interfaces.msg", reason="needs flexarm_interfaces")

from sensor_msgs.msg import JointState  # noqa: E402

from flexarm_controller.drives.attachment import Attachment  # noqa: E402
from flexarm_controller.drives.conversions import effort_msg, sealed_from_msg  # noqa: E402
from flexarm_controller.drives.effort_writer import EffortWriter  # noqa: E402
from flexarm_controller.drives.seal import Mark, Seal  # noqa: E402

SECRET, EPOCH_NS = "0123456789abcdef", 1_700_000_000_000_000_000


def read(written: Any) -> JointState:
    """Return the message that drives get."""
    return serialization.deserialize_message(written, JointState) if isinstance(written, bytes) else written


@pytest.mark.parametrize("names", [("base.rz",), ("a", "b", "c")], ids=len)
def test_what_is_written_is_what_was_sealed(names: tuple[str, ...]) -> None:
    rng, seal, drives = np.random.default_rng(1), Seal(SECRET), Attachment()
    drives.attach(SECRET)
    writes: list[JointState] = []

    def serialise(msg: JointState) -> bytes:
        writes.append(msg)
        return bytes(serialization.serialize_message(msg))

    writer = EffortWriter(names, serialise)
    for k in range(300):
        effort = [float(each) for each in rng.normal(size=len(names))]
        mark, stamp_ns = Mark(bool(k % 7), k // 3), EPOCH_NS + 2_000_000 * k
        msg = read(writer.write(effort, stamp_ns, seal, mark))
        assert msg == effort_msg(names, effort, stamp_ns, seal, mark)
        assert drives.open(sealed_from_msg(msg)) == mark
    assert drives.refused == 0
    assert len(writes) == 3  # "standing" is a letter longer than "driving", and counts have one or two digits


def test_with_another_secret_nothing_opens() -> None:
    writer, drives = (
        EffortWriter(("a",), lambda msg: bytes(serialization.serialize_message(msg))),
        Attachment(),
    )
    drives.attach(SECRET)
    for k in range(3):
        msg = read(writer.write([1.0], EPOCH_NS + k, Seal("another"), Mark(True, 0)))
        assert drives.open(sealed_from_msg(msg)) is None
