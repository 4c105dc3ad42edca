"""The stamp of a serialised message, read without decoding the message (no ROS needed)."""

from __future__ import annotations

import struct

NS_PER_S = 1_000_000_000
LITTLE_ENDIAN = 1  # bit of the second byte of the encapsulation
_STAMP = (struct.Struct(">iI"), struct.Struct("<iI"))  # sec, nanosec: the header is the first field


def header_stamp_ns(cdr: bytes) -> int:
    """Return the stamp of a serialised message that starts with a std_msgs/Header [ns]."""
    sec, nanosec = _STAMP[cdr[1] & LITTLE_ENDIAN].unpack_from(cdr, 4)
    return int(sec) * NS_PER_S + int(nanosec)
