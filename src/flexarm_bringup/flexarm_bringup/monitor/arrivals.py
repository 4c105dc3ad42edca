"""Arrivals of one topic: its newest message as bytes, and the rhythm of the last seconds."""

from __future__ import annotations

from collections import deque

import numpy as np

from flexarm_bringup.bags.cdr import has_stamp, header_stamp_ns
from flexarm_bringup.monitor.picture import UNKNOWN, TopicRow

WINDOW = 3.0  # s that a rate is told of
CATCH_UP = (
    0.5  # s from the first arrival on, in which what waited while others were subscribed to comes in one go
)
MOST = 5000  # arrivals kept
RING = 32  # newest messages kept by stamp


class Arrivals:
    """One topic."""

    def __init__(self, name: str, is_stamped: bool) -> None:
        """Expect messages; stamped ones begin with a std_msgs/Header."""
        self.name = name
        self._is_stamped = is_stamped
        self._times: deque[float] = deque(maxlen=MOST)  # after catching up
        self._first, self._last = UNKNOWN, UNKNOWN
        self._ring: dict[int, bytes] = {}
        self.newest: bytes | None = None

    def add(self, t: float, raw: bytes) -> None:
        """Note a message that arrived at ``t`` [s]."""
        if self.newest is None:
            self._first = t
        if t - self._first >= CATCH_UP:
            self._times.append(t)
        self._last, self.newest = t, raw
        if self._is_stamped and has_stamp(raw):
            self._ring[header_stamp_ns(raw)] = raw
            while len(self._ring) > RING:
                self._ring.pop(next(iter(self._ring)))

    def at(self, stamp_ns: int) -> bytes | None:
        """Return the message of a stamp [ns], if it is among the newest."""
        return self._ring.get(stamp_ns)

    def stamps(self) -> list[int]:
        """Return the stamps of the newest messages [ns]."""
        return list(self._ring)

    def row(self, t: float) -> TopicRow:
        """Return the rhythm of the last seconds before ``t`` [s]; none is known while it catches up."""
        while len(self._times) > 1 and self._times[0] < t - WINDOW:
            self._times.popleft()
        age = t - self._last
        gaps = np.diff(np.array(self._times))
        if not gaps.size:
            return TopicRow(self.name, UNKNOWN, UNKNOWN, UNKNOWN, age)
        mean = float(gaps.mean())
        rate = 1.0 / mean if mean > 0.0 else UNKNOWN
        return TopicRow(self.name, rate, float(gaps.std()), float(gaps.max()), age)


def newest_common(a: Arrivals, b: Arrivals) -> int | None:
    """Return the newest stamp that both have [ns]."""
    common = set(a.stamps()) & set(b.stamps())
    return max(common, default=None)
