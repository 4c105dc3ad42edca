"""Messages as bytes: equal messages give equal bytes, and the stamp is read without decoding."""

import ctypes
from typing import Any

import pytest

from flexarm_bringup.bags.cdr import header_stamp_ns
from flexarm_bringup.topics import STREAMS

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
conversions = pytest.importorskip("flexarm_bringup.conversions", reason="needs ROS and flexarm_interfaces")

MODAL = "flexarm_interfaces/msg/ModalState"


def modal_state() -> Any:
    msg = conversions.message_class(MODAL)(model_id="abc", theta=[1.0], reason="five5", names=["m1", "m22"])
    msg.header.stamp.sec, msg.header.stamp.nanosec = 1_700_000_000, 999_999_999
    return msg


def soil_heap(value: int) -> None:
    """Leave ``value`` in the memory that the next serialisation will be given."""
    c = ctypes.CDLL(None)
    c.malloc.restype, c.free.argtypes = ctypes.c_void_p, [ctypes.c_void_p]
    for size in range(64, 512, 8):
        blocks = [c.malloc(size) for _ in range(5)]
        for block in blocks:
            ctypes.memset(block, value, size)
        for block in blocks:
            c.free(block)


def test_equal_messages_give_equal_bytes_whatever_the_memory_held() -> None:
    seen = set()
    for value in range(50):
        soil_heap(value)
        seen.add(conversions.serialise(modal_state(), MODAL))
    assert len(seen) == 1


@pytest.mark.parametrize("kind", sorted({stream.type for stream in STREAMS}))
def test_every_type_of_the_table_survives_the_round_trip(kind: str) -> None:
    msg = conversions.message_class(kind)()
    assert conversions.deserialise(conversions.serialise(msg, kind), kind) == msg


def test_content_survives_the_round_trip() -> None:
    assert conversions.deserialise(conversions.serialise(modal_state(), MODAL), MODAL) == modal_state()


def test_the_stamp_is_read_from_the_bytes() -> None:
    cdr = conversions.serialise(modal_state(), MODAL)
    assert header_stamp_ns(cdr) == 1_700_000_000_999_999_999
    big_endian = bytes([0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 2])
    assert header_stamp_ns(big_endian) == 1_000_000_002


@pytest.mark.parametrize("stream", [stream for stream in STREAMS if stream.is_stamped], ids=lambda s: s.topic)
def test_a_stamped_stream_starts_with_a_header(stream: Any) -> None:
    fields = conversions.message_class(stream.type).get_fields_and_field_types()
    assert next(iter(fields.items())) == ("header", "std_msgs/Header")
