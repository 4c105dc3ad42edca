"""Statuses as bytes are those of their messages, whatever changes from one to the next."""

from __future__ import annotations

import numpy as np
import pytest

pytestmark = pytest.mark.ros
serialization = pytest.importorskip("rclpy.serialization", reason="needs ROS")
messages = pytest.importorskip("flexarm_interfaces.msg", reason="needs flexarm_interfaces")

from flexarm_controller.command import ControlCommand  # noqa: E402
from flexarm_controller.conversions import status_to_msg  # noqa: E402
from flexarm_controller.reference import hold  # noqa: E402
from flexarm_controller.status_writer import StatusWriter  # noqa: E402

STAMP_NS = 1_700_000_000_123_456_789
SOLVED = ControlCommand(
    0.0, 0.01, np.array([0.1, 0.2]), "a1", "mpc", "", "solved", 3, 1e-9, 2e-4, (), np.zeros((1, 2)),
    hold(np.array([0.1, 0.2])), np.zeros(2), np.zeros((1, 2)),
)  # fmt: skip


def test_statuses_are_those_of_the_messages_and_bytes_where_only_numbers_change() -> None:
    writer = StatusWriter(serialization.serialize_message)
    commands = [
        *(SOLVED._replace(iterations=k, residual=1e-9 * k, theta=np.full(2, 0.1 * k)) for k in range(4)),
        *(SOLVED._replace(limits_active=("torque:base.rz",), solve_time=1e-4 * k) for k in range(3)),
        *(SOLVED._replace(mode="hold", reason=f"lost for {k} ms") for k in range(3)),
    ]
    told = [writer.write(command, k, 2 * k, STAMP_NS + k) for k, command in enumerate(commands)]
    for k, (raw, command) in enumerate(zip(told, commands, strict=True)):
        kind = messages.ControllerStatus
        read = serialization.deserialize_message(raw, kind) if isinstance(raw, bytes) else raw
        assert read == status_to_msg(command, k, 2 * k, STAMP_NS + k)
    assert "".join("b" if isinstance(raw, bytes) else "m" for raw in told) == "mmbb" + "mmb" + "mmm"
