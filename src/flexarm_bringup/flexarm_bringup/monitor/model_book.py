"""Served models by their hash: many come ahead of a motion, few are ever looked at."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from flexarm_model.served.reduced_model import ReducedModel

MOST = 500  # as many as a motion may need


class ModelBook:
    """Keeps models as bytes and reads those that are asked for."""

    def __init__(self, read: Callable[[bytes], ReducedModel]) -> None:
        """Read models with ``read``, which raises ValueError for one that cannot be used."""
        self._read = read
        self._unread: deque[bytes] = deque(maxlen=MOST)
        self._known: dict[str, ReducedModel] = {}
        self._newest: ReducedModel | None = None

    def add(self, raw: bytes) -> None:
        """Keep a model."""
        self._unread.append(raw)

    def find(self, model_id: str) -> ReducedModel | None:
        """Return the model of a hash, else the newest that can be read; None before the first."""
        while self._unread and model_id not in self._known:
            try:
                self._newest = self._read(self._unread.popleft())
            except ValueError:
                continue
            self._known[self._newest.model_id] = self._newest
            while len(self._known) > MOST:
                self._known.pop(next(iter(self._known)))
        return self._known.get(model_id, self._newest)
