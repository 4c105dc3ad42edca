"""Is every stamp of a bag that of one instant? Not where a clock was set back, or two recordings are in it.

What is found by its stamp, as the truth is, is then that of another instant. A recorder whose own clock was
set back writes both instants at one time, and a bag is read by time: they stand side by side, twice as dense.
"""

from __future__ import annotations

import numpy as np

from flexarm_bringup.bags.bag_reader import Bag
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.bags.cdr import header_stamp_ns
from flexarm_bringup.topics import NAMESPACE
from flexarm_model.conversions import NS_PER_S

STATES = f"{NAMESPACE}/joint_states"
DENSE = 1.5  # times as many states in a second as is usual
EXPECTED = "two recordings, or a clock that was set back; expected one run, in which a stamp is one instant"


def check_instants(bag: Bag, longest_return: float) -> None:
    """Refuse a bag of which a stamp is that of two instants.

    Args:
        bag: The bag.
        longest_return: A longer step back starts the estimator anew [s].

    Raises:
        BagError: It is; says where.
    """
    stamps = np.array([header_stamp_ns(r.cdr) for r in bag.records if r.name == STATES], dtype=np.int64)
    if stamps.size < 2:
        return
    back = -np.diff(stamps) / NS_PER_S
    at = int(np.argmax(back))
    if back[at] > longest_return:
        where = f"run back by {back[at]:.3g} s at {stamps[at] / NS_PER_S:.3f} s"
        raise BagError(f"{bag.path}: the stamps of joint_states {where}: {EXPECTED}")
    seconds, counts = np.unique((stamps - stamps.min()) // NS_PER_S, return_counts=True)
    most, whole = int(np.argmax(counts)), counts[1:-1]  # the first and the last may be parts
    if whole.size and counts[most] > DENSE * (usual := float(np.median(whole))):
        since = stamps.min() / NS_PER_S + seconds[most]
        where = f"{counts[most]} joint_states from {since:.3f} s to a second later"
        raise BagError(f"{bag.path}: {where}, usual are {usual:.0f}: {EXPECTED}")
