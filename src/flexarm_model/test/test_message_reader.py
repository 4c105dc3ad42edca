"""Messages read from their bytes are those that rclpy reads."""

from functools import partial
from typing import Any

import numpy as np
import pytest

pytestmark = pytest.mark.ros
serialization = pytest.importorskip("rclpy.serialization", reason="needs ROS")
interfaces = pytest.importorskip("flexarm_interfaces.msg", reason="needs flexarm_interfaces")

from geometry_msgs.msg import PoseWithCovarianceStamped  # noqa: E402
from sensor_msgs.msg import Imu, JointState  # noqa: E402

from flexarm_model.ros.message_reader import MOST_SHAPES, MOST_VALUES, MessageReader  # noqa: E402

OURS = ("StrainArray", "JointCommand", "ModalState", "GuardStatus")
KINDS = [JointState, Imu, PoseWithCovarianceStamped, *(getattr(interfaces, name) for name in OURS)]
NUMBERS = {"double": float, "uint8": int, "uint64": int, "int32": int, "uint32": int}


class Counting:
    """Reads with rclpy and counts how often."""

    def __init__(self, kind: type) -> None:
        self.kind, self.count = kind, 0

    def __call__(self, raw: bytes) -> Any:
        self.count += 1
        return serialization.deserialize_message(raw, self.kind)


def drawn(kind: Any, rng: np.random.Generator, length: Any, letters: str = "abc é") -> Any:
    """Return a message whose texts and sequences have lengths that ``length`` draws."""
    msg = kind()
    for name, type_name in kind.get_fields_and_field_types().items():
        setattr(msg, name, value(type_name, getattr(msg, name), rng, length, letters))
    return msg


def value(type_name: str, old: Any, rng: np.random.Generator, length: Any, letters: str) -> Any:
    if type_name.startswith("sequence<"):
        element = type_name[len("sequence<") : -1]
        like = interfaces.SensorHealth() if element.endswith("SensorHealth") else old
        return [value(element, like, rng, length, letters) for _ in range(length())]
    if type_name == "string":
        return "".join(rng.choice(list(letters), length()))
    if type_name in NUMBERS:
        return NUMBERS[type_name](rng.integers(0, 100)) + (0.25 if type_name == "double" else 0)
    if type_name.endswith("]"):
        return rng.normal(size=len(old))
    return drawn(type(old), rng, length, letters)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_messages_of_any_lengths_are_read_as_rclpy_reads_them(kind: Any) -> None:
    rng = np.random.default_rng(1)
    reader = MessageReader(kind, partial(serialization.deserialize_message, message_type=kind))
    for _ in range(40):
        msg = drawn(kind, rng, lambda: int(rng.integers(0, 4)))
        raw = serialization.serialize_message(msg)
        assert reader.read(raw) == msg
        assert reader.read(raw) == msg  # now of a shape that is known


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_of_messages_that_look_alike_rclpy_reads_one(kind: Any) -> None:
    rng, known = np.random.default_rng(2), Counting(kind)
    reader = MessageReader(kind, known)
    for _ in range(20):
        msg = drawn(kind, rng, lambda: 3, "abc")
        assert reader.read(serialization.serialize_message(msg)) == msg
    assert known.count == 1


def test_what_is_read_belongs_to_the_reader_alone() -> None:
    reader = MessageReader(JointState, Counting(JointState))
    raw = serialization.serialize_message(JointState(name=["a"], position=[1.0]))
    first, second = reader.read(raw), reader.read(raw)
    third = reader.read(raw)
    second.name.append("b")
    second.position.append(2.0)
    assert first == third == reader.read(raw)


def test_messages_with_numbers_that_are_none_are_read_too() -> None:
    reader = MessageReader(JointState, Counting(JointState))
    for position in (1.0, float("nan"), float("inf")):
        raw = serialization.serialize_message(JointState(name=["a"], position=[position]))
        assert np.array_equal(reader.read(raw).position, [position], equal_nan=True)


def test_bytes_that_are_no_message_are_refused_as_rclpy_does() -> None:
    reader = MessageReader(JointState, Counting(JointState))
    raw = serialization.serialize_message(JointState(name=["axis"], position=[1.0]))
    reader.read(raw)
    torn = bytearray(raw)
    torn[12:16] = b"\xff\xff\xff\x7f"  # the length of the frame's name
    for wrong in (bytes(torn), raw[:9], b""):
        with pytest.raises(serialization._rclpy.RMWError):
            reader.read(wrong)


def test_bytes_in_another_order_are_left_to_rclpy() -> None:
    known = Counting(JointState)
    reader = MessageReader(JointState, known)
    raw = serialization.serialize_message(JointState(name=["axis"], position=[1.0]))
    reader.read(raw)
    for _ in range(3):
        with pytest.raises(serialization._rclpy.RMWError):  # big endian lengths are far too large
            reader.read(b"\x00\x00" + raw[2:])
    assert known.count == 4


def test_neither_many_shapes_nor_long_messages_are_remembered() -> None:
    reader = MessageReader(JointState, Counting(JointState))
    for count in range(3 * MOST_SHAPES):
        reader.read(serialization.serialize_message(JointState(position=[1.0] * count)))
        assert len(reader._shapes) <= MOST_SHAPES
    reader._shapes.clear()
    reader.read(serialization.serialize_message(JointState(name=["a"] * MOST_VALUES)))
    assert not reader._shapes


def test_a_text_with_a_zero_in_it_ends_there_as_for_rclpy() -> None:
    """It was read whole, and whoever told of it ended: rclpy wrote it shorter than it was counted."""
    reader, msg = MessageReader(Imu, partial(serialization.deserialize_message, message_type=Imu)), Imu()
    msg.header.frame_id = "x" * 100
    raw = bytearray(serialization.serialize_message(msg))
    reader.read(bytes(raw))
    raw[raw.index(b"xxx")] = 0
    assert reader.read(bytes(raw)).header.frame_id == ""
