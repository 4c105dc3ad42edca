"""The header of a serialised message, read without decoding the message (no ROS needed)."""

from __future__ import annotations

import struct

NS_PER_S = 1_000_000_000
LITTLE_ENDIAN = 1  # bit of the second byte of the encapsulation
_STAMP = (struct.Struct(">iI"), struct.Struct("<iI"))  # sec, nanosec: the header is the first field
_LENGTH = (struct.Struct(">I"), struct.Struct("<I"))
_FRAME = 12  # where the length of frame_id begins; the text, with a zero at its end, follows


def has_stamp(cdr: bytes) -> bool:
    """Tell whether a serialised message is long enough to start with a std_msgs/Header."""
    return len(cdr) >= _FRAME


def header_stamp_ns(cdr: bytes) -> int:
    """Return the stamp of a serialised message that starts with a std_msgs/Header [ns]."""
    sec, nanosec = _STAMP[cdr[1] & LITTLE_ENDIAN].unpack_from(cdr, 4)
    return int(sec) * NS_PER_S + int(nanosec)


def header_frame_id(cdr: bytes) -> str:
    """Return the frame_id of a serialised message that starts with a std_msgs/Header; "" if it is cut."""
    if len(cdr) < _FRAME + 4:
        return ""
    (length,) = _LENGTH[cdr[1] & LITTLE_ENDIAN].unpack_from(cdr, _FRAME)
    text = cdr[_FRAME + 4 : _FRAME + 4 + length]
    return text.rstrip(b"\0").decode("utf8", errors="replace")
