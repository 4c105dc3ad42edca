"""In which order, and at which log time, received messages go into a bag.

In real time both are those of arrival. In lockstep the arrival times mean nothing: a message is
logged at the tick that delivered it (a camera frame at its arrival, not its exposure), and within a
tick in the order of the table of streams. So two recordings of one run hold the same sequence.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable, Sequence

from flexarm_bringup.bags.cdr import header_frame_id, header_stamp_ns
from flexarm_bringup.topics import Stream
from flexarm_model.ros.lockstep import Lockstep, Messages

Write = Callable[[str, int, bytes], None]  # absolute topic, log time [ns], CDR
NODES = ("rig", "estimator", "controller")
ANNOUNCED = ("rig", "guard")  # a tick counts what they have sent
USER = "user"
HORIZON_NS = 1_000_000_000  # a message may be this much later than the newest tick


class ArrivalLog:
    """Writes every message at once, at the time it was received."""

    def __init__(self, streams: Sequence[Stream], write: Write) -> None:
        self._write = write

    def add(self, stream: Stream, cdr: bytes, stamp_ns: int | None, received_ns: int) -> None:
        """Write a message.

        Args:
            stream: Where it came from.
            cdr: The message.
            stamp_ns: Stamp of its header [ns]; None when it has none.
            received_ns: When it was received [ns].
        """
        self._write(stream.name, received_ns, cdr)

    def announce(self, sequence: int, stamp_ns: int, topics: Sequence[str], counts: Sequence[int]) -> None:
        """Ticks do not matter here."""

    def close(self) -> int:
        """Return how many messages are known to be lost: none."""
        return 0


class LockstepLog:
    """Keeps messages until their tick is known, and sorts them."""

    def __init__(self, streams: Sequence[Stream], write: Write) -> None:
        self._write = write
        self._rank = {stream.topic: i for i, stream in enumerate(streams)}
        self._names = {stream.topic: stream.name for stream in streams}
        self._ticked = {s.topic for s in streams if s.publisher in ANNOUNCED and s.topic != "tick"}
        self._lockstep = Lockstep(self._ticked, self._on_complete)
        self._waiting: list[tuple[int, int, int, str, bytes]] = []  # log time, rank, arrival, topic, CDR
        self._arrivals = 0
        self._now_ns = 0

    def add(self, stream: Stream, cdr: bytes, stamp_ns: int | None, received_ns: int) -> None:
        """Take a message; see ``ArrivalLog.add``.

        What rig and guard send waits for its tick; what the nodes say bears the tick's stamp, also on a topic
        of the user's where ``frame_id`` names the node; the rest, and what comes from outside, is logged at
        the newest tick.
        """
        if stream.topic in self._ticked:
            self._lockstep.add(stream.topic, cdr)
        elif stamp_ns is None or stamp_ns < 0 or stream.is_latched or _source(stream, cdr) not in NODES:
            self._keep(self._now_ns, stream.topic, cdr)
        else:
            self._keep(stamp_ns, stream.topic, cdr)

    def announce(self, sequence: int, stamp_ns: int, topics: Sequence[str], counts: Sequence[int]) -> None:
        """Take the content of a tick."""
        self._lockstep.announce(sequence, stamp_ns, topics, counts)

    def close(self) -> int:
        """Write what is left and return how many messages of announced ticks never came."""
        lost = sum(self._lockstep.missing().values())
        for topic, received in self._lockstep.take_rest().items():
            for cdr in received:
                # after the newest tick, whose step it took no part in: a camera frame is stamped long before
                self._keep(max(self._now_ns + 1, header_stamp_ns(cdr)), topic, cdr)
        while self._waiting:
            self._write_next()
        return lost

    def _on_complete(self, stamp_ns: int, messages: Messages) -> None:
        self._now_ns = max(self._now_ns, stamp_ns)
        for topic, received in messages.items():
            for cdr in received:
                self._keep(stamp_ns, topic, cdr)
        while self._waiting and self._waiting[0][0] < self._now_ns - HORIZON_NS:
            self._write_next()

    def _keep(self, log_time_ns: int, topic: str, cdr: bytes) -> None:
        self._arrivals += 1
        heapq.heappush(self._waiting, (log_time_ns, self._rank[topic], self._arrivals, topic, cdr))

    def _write_next(self) -> None:
        log_time_ns, _, _, topic, cdr = heapq.heappop(self._waiting)
        self._write(self._names[topic], log_time_ns, cdr)


def _source(stream: Stream, cdr: bytes) -> str:
    """Return which node a stamped message is of; "" or anything for what comes from outside."""
    return header_frame_id(cdr) if stream.publisher == USER else stream.publisher
