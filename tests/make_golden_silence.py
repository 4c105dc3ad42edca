"""Make another golden case anew: sensors that freeze, fall silent and knock, and a clock that jumps.

    ./flexarm shell, then: python tests/make_golden_silence.py

The covariance of the accelerometer is too good to be true; the gauge repeats its value; the accelerometer is
once at the end of its range, then off for three samples; a strain is stamped half a millisecond late; encoder
and camera are silent for longer than their time-outs; encoder and gauge are knocked at once, which moves the
state; the encoder alone leaps farther than its axis can move; a reference comes that began too long ago, and
one that is fast; the clock jumps ahead, where the camera contradicts the others. The rate of the torque is
described so low that it binds. Recorded is what `single_link` is made of.
"""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from golden_edits import (
    Edit,
    Which,
    edited,
    from_then_on,
    redescribed,
    remake,
    restamped,
    set_first,
    with_edits,
)

from flexarm_bringup.bags.bag_copy import copy_bag
from flexarm_bringup.bags.bag_reader import Bag, Record
from flexarm_model.conversions import ns_to_stamp, stamp_to_ns

FOLDER = Path(__file__).parent / "golden"
RECORDED, CASE = FOLDER / "single_link" / "bag", FOLDER / "silence_and_jumps"
ABOUT = (
    "One second of single_link with a gauge that freezes, encoder and camera that fall silent, an encoder "
    "that leaps, covariances too small, a knock, references late and fast, and a clock that jumps "
    "(tests/make_golden_silence.py)."
)
AHEAD_NS, JUMP_NS = 700_000_000, 5_000_000_000
DESCRIBED = {"effort_rate: 2800 N m/s": "effort_rate: 8 N m/s"}
TOO_GOOD, FROZEN, OFF = range(15, 22), range(25, 40), range(55, 58)
CLIPPED, LATE, A_LITTLE_NS = 46, 50, 500_000
SILENT, NO_FRAME, KNOCKED, LEAPT = range(75, 93), range(8, 17), range(105, 200), range(125, 200)
KNOCK, LEAP, STRAIN = 0.01, 0.3, 4e-5  # rad, rad, 1
REFUSED_NS, FAST_NS, BEFORE_NS, FASTER = 500_000_000, 560_000_000, 300_000_000, 0.1


def off(field: str, value: float) -> Edit:
    """Return an edit that adds to the first element of a field."""
    return lambda msg: getattr(msg, field).__setitem__(0, getattr(msg, field)[0] + value)


def accelerated(change: float) -> Edit:
    """Return an edit that adds to an acceleration along y [m/s^2]."""

    def edit(msg: Any) -> None:
        msg.linear_acceleration.y += change

    return edit


def with_variance(value: float) -> Edit:
    """Return an edit that says how sure an acceleration is [m^2/s^4]."""

    def edit(msg: Any) -> None:
        msg.linear_acceleration_covariance[:] = np.diag([value] * 3).reshape(-1)

    return edit


def unannounced(*topics: str) -> Edit:
    """Return an edit of a tick that announces some topics no more."""

    def edit(msg: Any) -> None:
        kept = [(t, count) for t, count in zip(msg.topics, msg.counts, strict=True) if t not in topics]
        msg.topics, msg.counts = [t for t, _ in kept], [count for _, count in kept]

    return edit


def knocked(k: int) -> Edit:
    """Return what has become of the encoder's sample ``k``."""
    return off("position", KNOCK + (LEAP if k in LEAPT else 0.0))


EDITS: dict[Which, Edit] = {
    **{("strain", k): set_first("strain", 5e-7) for k in FROZEN},
    **{("tip_accelerometer", k): accelerated(20.0) for k in OFF},
    **{("tip_accelerometer", k): with_variance(1e-12) for k in TOO_GOOD},
    ("tip_accelerometer", CLIPPED): accelerated(489.0),
    ("strain", LATE): restamped(A_LITTLE_NS),
    **{("tick", k): unannounced("camera/pose") for k in range(200)},
    **{("tick", k): unannounced("camera/pose", "joint_states") for k in SILENT},
    **{("strain", k): off("strain", STRAIN) for k in KNOCKED},
    **{("joint_states", k): knocked(k) for k in KNOCKED},
}
WITHOUT = {("joint_states", k) for k in SILENT} | {("pose", k) for k in NO_FRAME}


def bad_bag(recorded: Bag, folder: Path) -> Bag:
    """Write a bag anew as told above, without what estimator and controller said."""
    bag = redescribed(recorded, DESCRIBED)
    records = with_edits(bag.records, EDITS, without=WITHOUT)
    reference = next(record for record in records if record.name.endswith("/reference"))
    for at_ns, edit in ((REFUSED_NS, _begun(REFUSED_NS - BEFORE_NS)), (FAST_NS, _begun(FAST_NS, FASTER))):
        _insert(records, replace(edited(reference, edit), log_time_ns=at_ns))
    return copy_bag(bag, folder, from_then_on(records, AHEAD_NS, JUMP_NS))


def _begun(at_ns: int, share: float = 1.0) -> Edit:
    """Return an edit of a reference: when it begins [ns], and in which share of its time it is run."""

    def edit(msg: Any) -> None:
        msg.header.stamp = ns_to_stamp(at_ns)
        for point in msg.points:
            duration_ns = stamp_to_ns(point.time_from_start)
            point.time_from_start.sec, point.time_from_start.nanosec = divmod(
                round(share * duration_ns), 1_000_000_000
            )

    return edit


def _insert(records: list[Record], record: Record) -> None:
    first = next(i for i, other in enumerate(records) if other.log_time_ns >= record.log_time_ns)
    records.insert(first, record)


if __name__ == "__main__":
    remake(CASE, RECORDED, bad_bag, ABOUT, math.inf)
