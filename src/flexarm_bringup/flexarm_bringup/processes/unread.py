"""Messages of a topic, as bytes until somebody looks: who watches a rig must not keep its cores busy."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, overload


class Unread(Sequence[Any]):
    """Messages in the order in which they came; each is read once."""

    def __init__(self, decode: Callable[[bytes], Any]) -> None:
        """Start empty; ``decode`` makes a message of its bytes."""
        self._decode = decode
        self._messages: list[Any] = []  # bytes, or what was made of them

    def append(self, raw: bytes) -> None:
        """Note a message."""
        self._messages.append(raw)

    def clear(self) -> None:
        """Forget all of them."""
        self._messages.clear()

    def __len__(self) -> int:
        """Return how many there are."""
        return len(self._messages)

    @overload
    def __getitem__(self, k: int) -> Any: ...

    @overload
    def __getitem__(self, k: slice) -> list[Any]: ...

    def __getitem__(self, k: int | slice) -> Any:
        """Return one, or a list of some."""
        if isinstance(k, slice):
            return [self[i] for i in range(*k.indices(len(self)))]
        if isinstance(self._messages[k], bytes):
            self._messages[k] = self._decode(self._messages[k])
        return self._messages[k]

    def __delitem__(self, k: int | slice) -> None:
        """Forget one or some."""
        del self._messages[k]

    def __iter__(self) -> Iterator[Any]:
        """Go through all that are there now."""
        return (self[k] for k in range(len(self)))
