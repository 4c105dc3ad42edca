"""Whether a trajectory may be read at all, told from its bytes.

To make a message of its bytes costs rclpy 8 to 15 us a point, to hold it against the limits of the arm as
much again, and no other message is heard meanwhile: while the guard is armed, the controller must not be
silent for as long as the guard waits. The points are ends of cubics, not samples.
"""

from __future__ import annotations

import struct

MOST_POINTS, MOST_NAMES = 1000, 64
MOST_AWAITED_BYTES = 400 * MOST_POINTS  # a point of six axes with all that is heeded takes 170
MOST_BYTES = 4_000_000  # of twenty times as many points of six axes with all that is heeded of them
_HEAD, _STAMP = 4, 8  # bytes before the content, from which alignment counts; of the header's stamp
_ALIGN = 4


def has_too_many_points(raw: bytes, is_awaited: bool) -> str:
    """Return that a trajectory_msgs/JointTrajectory is too large to be read; empty where it is not.

    Args:
        raw: Of the message (CDR of OMG DDS-XTypes 1.3, 7.4.1); what cannot be read so is for the reader.
        is_awaited: Commands are: the guard is armed, and time does not stand.
    """
    if len(raw) > MOST_BYTES:
        return f"message of more than {MOST_BYTES} bytes"
    if not is_awaited:
        return ""
    try:
        names, points = _count(raw)
    except struct.error:
        return ""
    armed = "while the guard is armed"
    if names > MOST_NAMES:
        return f"{names} joint names, at most {MOST_NAMES} {armed}"
    if points > MOST_POINTS:
        return f"{points} points, at most {MOST_POINTS} {armed}: between them it is a cubic"
    return f"{len(raw)} bytes, at most {MOST_AWAITED_BYTES} {armed}" if len(raw) > MOST_AWAITED_BYTES else ""


def _count(raw: bytes) -> tuple[int, int]:
    """Return the numbers of names and of points; of too many names nobody asks for the points."""
    order = "<" if raw[1:2] == b"\x01" else ">"

    def number(place: int) -> int:
        """Return the length that stands there."""
        return int(struct.unpack_from(f"{order}I", raw, place)[0])

    def after_text(place: int) -> int:
        """Return where what follows a text begins."""
        return place + _ALIGN + (number(place) + _ALIGN - 1) // _ALIGN * _ALIGN

    place = after_text(_HEAD + _STAMP)
    names, place = number(place), place + _ALIGN
    if names > MOST_NAMES:
        return names, 0
    for _ in range(names):
        place = after_text(place)
    return names, number(place)
