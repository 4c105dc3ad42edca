"""Who of a graph is not ready yet: told after a while, and again whenever twice the time has passed.

A node says in its log what it waits for, and on /diagnostics what is wrong with it, which is told, too: a
reason that cannot change would be waited for in vain. One that hangs says nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

FIRST = 20.0  # s; nodes take 2-5 s, up to a minute where an arm is compiled for the first time


class Complaints:
    """What nodes have said of themselves that is not well, until they say that it is."""

    def __init__(self) -> None:
        """Begin with none."""
        self._said: dict[str, str] = {}

    def hear(self, subject: str, text: str, *, is_well: bool) -> None:
        """Take what is said of a subject, "node: part of it"."""
        self._said.pop(subject, None)
        if not is_well:
            self._said[subject] = text

    def of(self, node: str) -> str:
        """Return what a node complains of; empty when of nothing."""
        return "; ".join(text for subject, text in self._said.items() if subject.startswith(f"{node}: "))


class LateNodes:
    """Looks at a clock and at who is ready."""

    def __init__(self) -> None:
        """Begin with nobody late."""
        self._since: float | None = None
        self._patience = FIRST

    def look(
        self, t: float, ready: Mapping[str, bool], complaint_of: Callable[[str], str] = lambda node: ""
    ) -> str:
        """Return who keeps the others waiting if that is to be told now; else nothing.

        Args:
            t: Now [s].
            ready: Whether each node is, by name.
            complaint_of: What a node says is wrong with it.
        """
        late = [name for name, is_ready in ready.items() if not is_ready]
        if self._since is None or not late:
            self._since, self._patience = t if late else None, FIRST
            return ""
        waited = t - self._since
        if waited < self._patience:
            return ""
        self._patience *= 2.0
        told = [f"{name} ({said})" if (said := complaint_of(name)) else name for name in late]
        return f"not ready after {waited:.0f} s: {', '.join(told)}"
