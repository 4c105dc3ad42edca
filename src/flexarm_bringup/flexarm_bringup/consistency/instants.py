"""Is every stamp of a bag that of one instant? Not where a clock was set back, or two recordings are in it.

What is found by its stamp, as the truth is, is then that of another instant. Stamps that run back by less
than the estimator remembers start nothing anew. A recorder whose own clock was set back writes both instants
at one time, and a bag is read by time. Either way a stretch of time is told twice, so states are twice as
dense there. Messages that come late or out of order are not, nor is one that was recorded twice two instants.
"""

from __future__ import annotations

import numpy as np

from flexarm_bringup.bags.bag_reader import Bag
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.bags.cdr import header_stamp_ns
from flexarm_bringup.topics import NAMESPACE
from flexarm_model.conversions import NS_PER_S

STATES = f"{NAMESPACE}/joint_states"
DENSE = 1.5  # times as many states as is usual
LOOKED = 20  # usual periods in which they are counted: what is told twice for ten of them is found
EXPECTED = "two recordings, or a clock that was set back; expected one run, in which a stamp is one instant"


def check_instants(bag: Bag, longest_return: float) -> None:
    """Refuse a bag of which a stamp is that of two instants.

    Args:
        bag: The bag.
        longest_return: A longer step back is told as such, wherever it is [s].

    Raises:
        BagError: It is; says where.
    """
    told = dict.fromkeys((header_stamp_ns(r.cdr), r.cdr) for r in bag.records if r.name == STATES)
    stamps = np.array([stamp for stamp, _ in told], dtype=np.int64)
    if stamps.size < 2:
        return
    back = -np.diff(stamps) / NS_PER_S
    at = int(np.argmax(back))
    if back[at] > longest_return:
        where = f"run back by {back[at]:.3g} s at {stamps[at] / NS_PER_S:.3f} s"
        raise BagError(f"{bag.path}: the stamps of joint_states {where}: {EXPECTED}")
    stamps.sort()
    window = round(LOOKED * float(np.median(np.diff(stamps))))
    counts = np.searchsorted(stamps, stamps + window) - np.arange(stamps.size)
    most = int(np.argmax(counts))
    if counts[most] > DENSE * LOOKED:
        since, lasts = stamps[most] / NS_PER_S, window / NS_PER_S
        where = f"{counts[most]} joint_states from {since:.3f} s to {lasts:.3g} s later"
        raise BagError(f"{bag.path}: {where}, usual are {LOOKED}: {EXPECTED}")
