"""Bounds of the fault matrix that are missed today, and why; each must fail, or it has to leave this list.

``./flexarm faults`` prints measured against bound and ends 1 because of them. No bound was bent. A row may
miss what is listed of it and nothing else: an accelerometer in g was off by 12 e0 behind an encoder that no
filter can replace.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import pytest

from flexarm_bringup.fault_drill.findings import Finding


class Missed(NamedTuple):
    """What a row misses and why."""

    reason: str
    findings: tuple[str, ...]  # their names in the table


_CAMERA = (
    "0.5 mm at 30 Hz are left of 13 um at the tip: the least error of any filter is 234 um, 65 wanted, "
    "unless the torque is known to a millionth (fault_drill.least_error)"
)

_OTHER_6R = (
    "with mass +50 % 4.9 times as much vibration is left (2), with stiffness -30 % 2.3 times (2): its gains "
    "were searched for 20 % less stiffness"
)

TIP, RESIDUAL = "tip RMS / e0", "residual / nominal"
MISSED = {
    ("single_link", 4): Missed(_CAMERA, (TIP,)),
    ("single_link", 9): Missed(_CAMERA, (TIP,)),
    ("single_link", 17): Missed(_CAMERA, (f"encoder: {TIP}",)),
    ("serial_6r", 31): Missed(_OTHER_6R, (RESIDUAL,)),
    ("serial_6r", 32): Missed(_OTHER_6R, (RESIDUAL,)),
}
_OTHERS = (
    "where others use the cores (3RRR, load 8 to 12) the first message of a node came after 2.1 and 3.3 s "
    "(2) in 2 of 13 kills; alone both arms keep all"
)
NOW_AND_THEN = {43: Missed(_OTHERS, ("first message after",))}  # of every machine: ends of their names


def judge(machine: str, row: int, findings: Iterable[Finding]) -> None:
    """Fail where another bound is missed than is listed of a row, or one that is listed is kept."""
    missed = {
        f.what: f"{f.what}: {f.measured:.4g} {f.unit}, wanted {f.bound}" for f in findings if not f.passed
    }
    reason, listed = MISSED.get((machine, row), Missed("", ()))
    why, ends = NOW_AND_THEN.get(row, Missed("", ()))
    at_times = {name for name in missed if ends and name.endswith(ends)}
    told = f"listed: {listed}\nmissed:\n" + "\n".join(missed.values())
    assert set(missed) - at_times == set(listed), told
    if listed or at_times:
        pytest.xfail(reason or why)
