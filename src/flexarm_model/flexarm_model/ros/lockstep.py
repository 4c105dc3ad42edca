"""Lockstep: act when everything that was announced for an instant has arrived.

The simulated rig sends the messages of an instant and then a tick that counts them. Messages of
one topic keep their order, messages of different topics do not, so each topic has its own queue
and a tick is complete when every announced topic holds enough. Stamps play no part: a camera
frame carries the stamp of its exposure, not of the tick that delivers it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

Messages = Mapping[str, Sequence[Any]]


@dataclass(frozen=True)
class _Tick:
    stamp_ns: int
    counts: dict[str, int]  # of the topics this node subscribes to


class Lockstep:
    """Collects the messages of a tick and hands them over together, tick by tick.

    Attributes:
        discarded: Messages that no tick asked for, dropped after a gap in the ticks [1].
    """

    def __init__(self, topics: Iterable[str], on_complete: Callable[[int, Messages], None]) -> None:
        """Collect ``topics``, named as in Tick.topics.

        Args:
            topics: What the node subscribes to.
            on_complete: Called with the tick's stamp [ns] and its messages by topic, in order of
                arrival; a topic that the tick does not announce is absent.
        """
        self._queues: dict[str, deque[Any]] = {topic: deque() for topic in topics}
        self._ticks: deque[_Tick] = deque()
        self._on_complete = on_complete
        self._sequence = -1
        self.discarded = 0

    def add(self, topic: str, message: Any) -> None:
        """Take a message of one of the topics.

        Raises:
            KeyError: ``topic`` is not one of those given at construction.
        """
        self._queues[topic].append(message)
        self._hand_over()

    def announce(self, sequence: int, stamp_ns: int, topics: Sequence[str], counts: Sequence[int]) -> None:
        """Take a tick. After a gap in ``sequence`` what belongs to older ticks is dropped.

        One whose topics and counts are not as many is none of the rig's, and is not taken.
        """
        if len(topics) != len(counts):
            return
        announced = dict(zip(topics, counts, strict=True))
        wanted = {topic: int(n) for topic, n in announced.items() if topic in self._queues and n > 0}
        if sequence != self._sequence + 1:
            self._ticks.clear()
            self._drop_older(wanted)
        self._sequence = sequence
        self._ticks.append(_Tick(stamp_ns, wanted))
        self._hand_over()

    def missing(self) -> dict[str, int]:
        """Return how many messages of each topic the oldest tick still waits for."""
        if not self._ticks:
            return {}
        short = {topic: n - len(self._queues[topic]) for topic, n in self._ticks[0].counts.items()}
        return {topic: n for topic, n in short.items() if n > 0}

    def take_rest(self) -> Messages:
        """Return, and forget, what no tick has asked for yet: what was sent after the last one."""
        rest = {topic: list(queue) for topic, queue in self._queues.items() if queue}
        for queue in self._queues.values():
            queue.clear()
        return rest

    def _hand_over(self) -> None:
        while self._ticks and not self.missing():
            tick = self._ticks.popleft()
            ready = {t: [self._queues[t].popleft() for _ in range(n)] for t, n in tick.counts.items()}
            self._on_complete(tick.stamp_ns, ready)

    def _drop_older(self, wanted: Mapping[str, int]) -> None:
        for topic, queue in self._queues.items():
            while len(queue) > wanted.get(topic, 0):
                queue.popleft()
                self.discarded += 1
