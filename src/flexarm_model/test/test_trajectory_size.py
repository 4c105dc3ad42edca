"""A trajectory that would take too long to read is known by its bytes."""

import pytest

pytest.importorskip("trajectory_msgs.msg")

from rclpy.serialization import serialize_message  # noqa: E402
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint  # noqa: E402

from flexarm_model.motion.size import (  # noqa: E402
    MOST_AWAITED_BYTES,
    MOST_BYTES,
    MOST_NAMES,
    MOST_POINTS,
    has_too_many_points,
)


def bytes_of(points: int, frame: str = "", names: tuple[str, ...] = ("base.rz",)) -> bytes:
    point = JointTrajectoryPoint(positions=[0.1] * len(names), velocities=[0.2] * len(names))
    msg = JointTrajectory(joint_names=list(names), points=[point] * points)
    msg.header.frame_id = frame
    return bytes(serialize_message(msg))


@pytest.mark.parametrize("frame", ["", "a", "base", "controller"])
@pytest.mark.parametrize("names", [(), ("base.rz",), ("q", "elbow.rz", "wrist_1.rx")])
def test_points_are_counted_whatever_the_texts_before_them(frame: str, names: tuple[str, ...]) -> None:
    assert has_too_many_points(bytes_of(MOST_POINTS, frame, names), is_awaited=True) == ""
    longer = bytes_of(MOST_POINTS + 1, frame, names)
    told = has_too_many_points(longer, is_awaited=True)
    assert told == "1001 points, at most 1000 while the guard is armed: between them it is a cubic"
    assert has_too_many_points(longer, is_awaited=False) == ""


def test_what_is_no_trajectory_is_left_to_its_reader_unless_it_is_huge() -> None:
    whole = bytes_of(3)
    for length in range(24):
        assert has_too_many_points(whole[:length], is_awaited=True) == ""
    assert (
        has_too_many_points(bytes(MOST_BYTES + 1), is_awaited=False) == "message of more than 4000000 bytes"
    )


def test_names_without_end_take_no_time() -> None:
    assert has_too_many_points(whole_of_names(), is_awaited=True).startswith("4294967295 joint names")


def whole_of_names() -> bytes:
    """Return bytes that promise four thousand million names and have one."""
    raw = bytearray(bytes_of(1))
    raw[20:24] = b"\xff" * 4
    return bytes(raw)


def test_what_is_large_otherwise_is_refused_while_commands_are_awaited() -> None:
    """Half a million names held the controller up for a second and a half, and were all quoted."""
    names = [f"j{k}" for k in range(MOST_NAMES + 1)]
    assert has_too_many_points(bytes_of(1, "", names), is_awaited=True).startswith(
        f"{len(names)} joint names"
    )
    assert not has_too_many_points(bytes_of(1, "", names), is_awaited=False)
    six = [f"joint_{k}.rz" for k in range(6)]
    assert not has_too_many_points(bytes_of(MOST_POINTS, "base", six), is_awaited=True)
    raw = bytes_of(10, "base", six) + bytes(MOST_AWAITED_BYTES)
    assert "bytes, at most" in has_too_many_points(raw, is_awaited=True)
