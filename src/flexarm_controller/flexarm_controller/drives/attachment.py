"""Whom the drives obey: one guard at a time, and nothing twice.

A guard that attaches gets a secret and seals its torques with it. Another one may attach only when the drives
have let go of the first and the arm is at rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flexarm_controller.drives.seal import Mark, Seal


@dataclass(frozen=True)
class Sealed:
    """Torques [N m] or [N] that arrived, the stamp [ns] from which they are to act, and their mark."""

    stamp_ns: int
    effort: Sequence[float]
    mark: str


class Attachment:
    """The guard that is attached, if one is.

    Attributes:
        refused: Torques refused: not of the attached guard, or of an instant that has been answered [1].
    """

    def __init__(self) -> None:
        """Obey nobody."""
        self._seal: Seal | None = None
        self._answered_ns = -1
        self.refused = 0

    @property
    def fingerprint(self) -> str:
        """Short name of the attached guard; empty when there is none."""
        return self._seal.fingerprint if self._seal else ""

    def attach(self, secret: str) -> None:
        """Obey who seals with this secret from now on, and nobody else."""
        self._seal, self._answered_ns = Seal(secret), -1

    def release(self) -> None:
        """Obey nobody."""
        self._seal = None

    def open(self, sealed: Sealed, oldest_ns: int = 0) -> Mark | None:
        """Return what the mark of torques says; None, and counted, when they must not act.

        Args:
            sealed: What arrived.
            oldest_ns: Stamp [ns] before which nothing is obeyed any more.
        """
        is_new = sealed.stamp_ns > self._answered_ns and sealed.stamp_ns >= oldest_ns
        read = self._seal.read if self._seal and is_new else None
        mark = read(sealed.mark, sealed.stamp_ns, sealed.effort) if read else None
        if mark is None:
            self.refused += 1
        else:
            self._answered_ns = sealed.stamp_ns
        return mark
