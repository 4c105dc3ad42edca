"""Who of a graph is not ready yet: told after a while, and again whenever twice the time has passed.

A node says itself what it waits for; one that hangs, or has never heard the model, says nothing.
"""

from __future__ import annotations

from collections.abc import Mapping

FIRST = 20.0  # s; nodes take 2-5 s, up to a minute where an arm is compiled for the first time


class LateNodes:
    """Looks at a clock and at who is ready."""

    def __init__(self) -> None:
        """Begin with nobody late."""
        self._since: float | None = None
        self._patience = FIRST

    def look(self, t: float, ready: Mapping[str, bool]) -> str:
        """Return who keeps the others waiting if that is to be told now; else nothing.

        Args:
            t: Now [s].
            ready: Whether each node is, by name.
        """
        late = [name for name, is_ready in ready.items() if not is_ready]
        if self._since is None or not late:
            self._since, self._patience = t if late else None, FIRST
            return ""
        waited = t - self._since
        if waited < self._patience:
            return ""
        self._patience *= 2.0
        return f"not ready after {waited:.0f} s: {', '.join(late)}"
