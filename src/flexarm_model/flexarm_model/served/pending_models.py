"""Models that wait for their time: a model is used from its stamp on, by everybody who has it.

Estimator and controller keep the same queue and go on with the same model in the same instant, because both
ask it with the stamp of that instant and never with a clock. Whoever speaks last about a time is right: a
model voids those that wait for its stamp or a later one.
"""

from __future__ import annotations

import hashlib
from collections import deque
from typing import Generic, TypeVar

Item = TypeVar("Item")


class PendingModels(Generic[Item]):
    """Whatever a node has prepared of each model, in order of time."""

    def __init__(self) -> None:
        """Start empty."""
        self._waiting: deque[tuple[int, Item]] = deque()
        self._count = 0
        self._digest = ""

    @property
    def receipt(self) -> str:
        """Count and hash of everything ever added: equal where the same was added in the same order."""
        return f"{self._count} models {self._digest}".rstrip()

    @property
    def waiting(self) -> tuple[tuple[int, Item], ...]:
        """What waits for its time, in order, each with the stamp from which it is to be used [ns]."""
        return tuple(self._waiting)

    def note(self, stamp_ns: int, model_id: str) -> None:
        """Count a model into the receipt."""
        self._count += 1
        self._digest = hashlib.sha256(f"{self._digest}{stamp_ns}{model_id}".encode()).hexdigest()[:16]

    def add(self, stamp_ns: int, item: Item) -> None:
        """Keep an item that is to be used from ``stamp_ns`` [ns] on."""
        while self._waiting and self._waiting[-1][0] >= stamp_ns:
            self._waiting.pop()
        self._waiting.append((stamp_ns, item))

    def due(self, stamp_ns: int) -> Item | None:
        """Take and return what is to be used from now on; None while nothing changes.

        Args:
            stamp_ns: Now [ns]; of several that are due the newest counts.
        """
        item = None
        while self._waiting and self._waiting[0][0] <= stamp_ns:
            item = self._waiting.popleft()[1]
        return item

    def has_after(self, stamp_ns: int) -> bool:
        """Tell whether something waits for a later time."""
        return bool(self._waiting) and self._waiting[-1][0] > stamp_ns
