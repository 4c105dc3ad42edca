"""What came on a topic, as bytes until somebody looks: who watches a rig must not keep its cores busy."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, overload

Arrival = tuple[float, Any]  # time.time() [s], message


class Heard(Sequence[Arrival]):
    """Arrivals in order of time."""

    def __init__(self, decode: Callable[[bytes], Any]) -> None:
        """Start empty; ``decode`` makes a message of its bytes."""
        self._decode = decode
        self._times: list[float] = []
        self._messages: list[Any] = []  # bytes, or what was made of them

    def add(self, at: float, raw: bytes) -> None:
        """Note a message that came at a time [s]."""
        self._times.append(at)
        self._messages.append(raw)

    def clear(self) -> None:
        """Forget everything."""
        self._times.clear()
        self._messages.clear()

    def came_after(self, since: float) -> bool:
        """Tell whether anything came after a time [s], without looking at it."""
        return bool(self._times) and self._times[-1] > since

    def after(self, since: float) -> list[Arrival]:
        """Return what came after a time [s]."""
        first = len(self._times)
        while first and self._times[first - 1] > since:
            first -= 1
        return [self[k] for k in range(first, len(self._times))]

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self._times)

    @overload
    def __getitem__(self, k: int) -> Arrival: ...

    @overload
    def __getitem__(self, k: slice) -> list[Arrival]: ...

    def __getitem__(self, k: int | slice) -> Arrival | list[Arrival]:
        """Return one or some."""
        if isinstance(k, slice):
            return [self[i] for i in range(*k.indices(len(self)))]
        if isinstance(self._messages[k], bytes):
            self._messages[k] = self._decode(self._messages[k])
        return self._times[k], self._messages[k]

    def __iter__(self) -> Iterator[Arrival]:
        """Go through all that are there now."""
        return (self[k] for k in range(len(self)))
