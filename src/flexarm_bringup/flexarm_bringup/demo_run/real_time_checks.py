"""Whether a run in real time leaves what the same run leaves in lockstep.

Another seed of the noise alone sets single rows apart, above all where little else is left: two lockstep runs
may be more than 3 dB apart in a row, not in the mean over the angles of a motion
(``test_demo_real_time``). So the mean is judged, and a single row by twice as much.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexarm_bringup.demo_run.study import Row
from flexarm_bringup.page.check import Check
from flexarm_bringup.residual import decibels

REAL_TIME_DB = 3.0  # of all moves of a motion, at most
ROW_DB = 6.0  # of a single row, at most


def real_time_checks(preset: str, real_time: Sequence[Row], lockstep: Sequence[Row]) -> list[Check]:
    """Return the bounds on how far the rows in real time may be from the same in lockstep."""
    apart: dict[str, list[float]] = {}
    for row, twin in zip(real_time, lockstep, strict=True):
        apart.setdefault(row.motion, []).append(decibels(row.figures.residual, twin.figures.residual))
    mean = max(abs(float(np.mean(rows))) for rows in apart.values())
    largest = max(abs(row) for rows in apart.values() for row in rows)
    found = (("mean over the angles", mean, REAL_TIME_DB), ("any row", largest, ROW_DB))
    name = f"{preset}: real time from lockstep"
    return [Check.at_most(f"{name}, {what}", db, most, "dB") for what, db, most in found]
