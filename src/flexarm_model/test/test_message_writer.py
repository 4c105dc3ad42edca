"""Messages written as bytes are read by rclpy as they were meant.

Bytes are not compared: what rclpy leaves between the fields and after the last one is anything. That nothing
is left after the last one here is tested where bags are read (flexarm_bringup).
"""

from array import array
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

pytestmark = pytest.mark.ros
serialization = pytest.importorskip("rclpy.serialization", reason="needs ROS")
interfaces = pytest.importorskip("flexarm_interfaces.msg", reason="needs flexarm_interfaces")

from geometry_msgs.msg import PoseWithCovarianceStamped  # noqa: E402
from sensor_msgs.msg import Imu, JointState  # noqa: E402

from flexarm_model.ros.message_writer import MOST_LAYOUTS, STAMP, MessageWriter  # noqa: E402


class Counting:
    """Writes with rclpy and counts how often."""

    def __init__(self) -> None:
        self.count = 0

    def __call__(self, msg: Any) -> bytes:
        self.count += 1
        return bytes(serialization.serialize_message(msg))


def joints(rng: np.random.Generator, names: list[str], text: str) -> JointState:
    drawn = (array("d", rng.normal(size=len(names))) for _ in range(3))
    msg = JointState(name=names, **dict(zip(("position", "velocity", "effort"), drawn, strict=True)))
    msg.header.frame_id = text
    return stamped(msg, rng)


def stamped(msg: Any, rng: np.random.Generator) -> Any:
    msg.header.stamp.sec, msg.header.stamp.nanosec = (int(rng.integers(0, 2**30)) for _ in range(2))
    return msg


def stamp(msg: Any) -> list[tuple[int]]:
    return [(msg.header.stamp.sec,), (msg.header.stamp.nanosec,)]


def read(written: Any, like: Any) -> Any:
    return serialization.deserialize_message(written, type(like)) if isinstance(written, bytes) else written


def assert_written(
    draw: Callable[[], Any], varying: tuple[str, ...], values: Callable[[Any], list[Any]]
) -> None:
    """Write messages of one key; all but the first two must be written without rclpy."""
    serialise = Counting()
    writer = MessageWriter((*STAMP, *varying), serialise)
    for k in range(20):
        msg = draw()
        written = writer.write("one", [*stamp(msg), *values(msg)], lambda msg=msg: msg)
        assert isinstance(written, bytes) == (k > 1)
        assert read(written, msg) == msg
    assert serialise.count == 1


@pytest.mark.parametrize("names", [["base.rz"], ["a", "bcd", "ef.g"]], ids=len)
def test_joint_states_are_written_as_rclpy_writes_them(names: list[str]) -> None:
    rng = np.random.default_rng(1)
    assert_written(
        lambda: joints(rng, names, f"driving {rng.integers(10, 99)}"),
        ("header.frame_id", "position", "velocity", "effort"),
        lambda msg: [(msg.header.frame_id.encode(),), msg.position, msg.velocity, msg.effort],
    )


def test_commands_are_written_as_rclpy_writes_them() -> None:
    rng = np.random.default_rng(2)

    def draw() -> Any:
        msg = interfaces.JointCommand(names=["é", "b"], model_id="0123", effort=rng.normal(size=2))
        msg.sequence, msg.session_token = int(rng.integers(2**40)), int(rng.integers(2**62))
        return stamped(msg, rng)

    assert_written(
        draw,
        ("sequence", "session_token", "effort"),
        lambda msg: [(msg.sequence,), (msg.session_token,), msg.effort],
    )


def test_parts_of_parts_and_arrays_are_found() -> None:
    rng = np.random.default_rng(3)

    def draw() -> Any:
        msg = Imu(linear_acceleration_covariance=rng.normal(size=9))
        msg.linear_acceleration.x = float(rng.normal())
        msg.header.frame_id = "tip"
        return stamped(msg, rng)

    names = ("linear_acceleration.x", "linear_acceleration_covariance")
    assert_written(
        draw, names, lambda msg: [(msg.linear_acceleration.x,), msg.linear_acceleration_covariance]
    )


def test_a_message_of_another_key_is_written_anew() -> None:
    rng, serialise = np.random.default_rng(4), Counting()
    writer = MessageWriter((*STAMP, "effort"), serialise)
    for count in (1, 3, 0) * 3:
        msg = JointState(name=["x"] * count, effort=rng.normal(size=count))
        assert read(writer.write(count, [*stamp(msg), msg.effort], lambda msg=msg: msg), msg) == msg
    assert serialise.count == 3


def test_what_changes_without_being_told_is_found_out_at_the_second_message() -> None:
    """Values that are not those of the message: it goes as it is, always."""
    serialise = Counting()
    writer = MessageWriter(("pose.pose.position.x",), serialise)
    for x in (1.0, 2.0, 3.0):
        msg = PoseWithCovarianceStamped()
        msg.pose.pose.position.x = x
        assert writer.write("one", [(x + 1.0,)], lambda msg=msg: msg) is msg
    assert serialise.count == 1


def test_a_field_that_does_not_exist_is_an_error() -> None:
    writer = MessageWriter(("colour",), Counting())
    writer.write("one", [(1,)], JointState)
    with pytest.raises(KeyError, match="colour"):
        writer.write("one", [(1,)], JointState)


def test_keys_that_come_once_are_not_learned_and_those_that_take_turns_are() -> None:
    """A number in a reason would make every state another layout, at a millisecond each."""
    serialise = Counting()
    writer = MessageWriter(STAMP, serialise)
    for k in range(3 * MOST_LAYOUTS):
        writer.write(f"lost for {k} ms", [(0,), (0,)], JointState)
    assert not serialise.count and len(writer._met) <= MOST_LAYOUTS
    told = [writer.write("ab"[k % 2], [(0,), (0,)], JointState) for k in range(6)]
    assert [isinstance(raw, bytes) for raw in told] == [False] * 4 + [True] * 2


def test_no_more_layouts_are_kept_than_a_topic_can_have() -> None:
    serialise = Counting()
    writer = MessageWriter(STAMP, serialise)
    for key in range(MOST_LAYOUTS + 1):
        for _ in range(2):
            writer.write(key, [(0,), (0,)], JointState)
    assert serialise.count == MOST_LAYOUTS + 1 and len(writer._layouts) == 1


def test_a_message_whose_text_has_a_zero_in_it_is_left_to_rclpy() -> None:
    rng = np.random.default_rng(8)
    writer = MessageWriter(STAMP, Counting())
    for _ in range(4):
        msg = joints(rng, ["a"], "\0" + "x" * 300)
        written = writer.write("key", stamp(msg), lambda msg=msg: msg)
        assert read(written, msg).position == msg.position
