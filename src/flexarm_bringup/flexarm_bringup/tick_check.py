"""Is a lockstep recording whole? Every tick says what was sent at its instant; the bag must have it.

But for the last tick: a recording may end in the middle of an instant.
"""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

from flexarm_bringup.bags.bag_reader import Bag, decode
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.topics import NAMESPACE, find_stream

TICK = f"{NAMESPACE}/tick"


def check_ticks(bag: Bag) -> int:
    """Return the number of ticks of a bag; 0 for one recorded in real time.

    Raises:
        BagError: A tick or a message that a tick announced is not in the bag; the last one's need not be.
    """
    logged = Counter((record.name, record.log_time_ns) for record in bag.records)
    ticks = [(record.log_time_ns, decode(record)) for record in bag.records if record.name == TICK]
    for (_, before), (_, tick) in pairwise(ticks):
        if tick.sequence <= before.sequence:
            raise BagError(
                f"{bag.path}: tick {tick.sequence} follows tick {before.sequence}: two runs in one bag"
            )
        if tick.sequence != before.sequence + 1:
            raise BagError(f"{bag.path}: tick {tick.sequence} follows tick {before.sequence}: messages lost")
    for log_time_ns, tick in ticks[:-1]:
        for topic, count in zip(tick.topics, tick.counts, strict=False):
            name = f"{NAMESPACE}/{topic}"
            found = logged[name, log_time_ns]
            if find_stream(name) is not None and found < count:
                text = f"tick {tick.sequence} announced {count} {topic}, the bag has {found}"
                raise BagError(f"{bag.path}: {text}")
    return len(ticks)
