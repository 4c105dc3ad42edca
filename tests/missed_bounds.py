"""Rows of the fault matrix that miss a bound today, and why; each must fail, or it has to leave this list.

``./flexarm faults`` prints measured against bound and ends 1 because of them. No bound was bent.
"""

from __future__ import annotations

import pytest

_CAMERA = (
    "0.5 mm at 30 Hz are left of 13 um at the tip: the least error of any filter is 234 um, 65 wanted, "
    "unless the torque is known to a millionth (fault_drill.least_error)"
)

_LATE = (
    "e0 is 17 um, so 2 e0 is less than the 50 um of one frame of the camera; a new estimator is back within "
    "it after 1.9 s instead of 1 s, off by 0.10 mm meanwhile"
)

_OTHER_6R = (
    "with mass +50 % the tip is off by 2.4 e0 (1.5) and 4.8 times as much vibration is left (2), with "
    "stiffness -30 % 2.3 times (2), with both the tip is off by 4.2 e0 (2.5): e0 is 20 um, and its gains "
    "were searched for 20 % less stiffness"
)

MISSED = {
    ("single_link", 4): _CAMERA,
    ("single_link", 9): _CAMERA,
    ("single_link", 17): _CAMERA,
    ("serial_6r", 31): _OTHER_6R,
    ("serial_6r", 32): _OTHER_6R,
    ("serial_6r", 33): _OTHER_6R,
    ("serial_6r", 45): _LATE,
}
WITH_NODES = {  # of every machine
    43: "where others use the cores (3RRR, load 8 to 12) the first message of a node came after 2.1 and 3.3 "
    "s (2) in 2 of 13 kills; alone both arms keep all",
}


def marks_of(machine: str, row: int) -> tuple[pytest.MarkDecorator, ...]:
    """Return the mark of a row that misses a bound; none for the others."""
    reason = MISSED.get((machine, row))
    return () if reason is None else (pytest.mark.xfail(reason=reason, strict=True),)


def marks_with_nodes(machine: str, row: int) -> tuple[pytest.MarkDecorator, ...]:
    """Return the mark of a row that misses a bound with nodes; how far depends on what else runs."""
    reason = WITH_NODES.get(row)
    return marks_of(machine, row) if reason is None else (pytest.mark.xfail(reason=reason, strict=False),)
