"""Which torque acted when: as the guard tells it, or as the drives measure it where no guard does.

What the guard tells is what it wants, without noise and in time. Where the drives measured something else, it
was not the guard who spoke, or the drives did not obey; then the drives are right.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_MOST_WAITING = 200  # torques
_AGREEMENT = 0.05  # share of the torque limit by which drives may measure another torque than acts


@dataclass(frozen=True)
class Torque:
    """A torque that acts from ``stamp_ns`` on, (n_theta,)."""

    stamp_ns: int
    tau: Array


class AppliedTorque:
    """Torques told so far, and the one that acts."""

    def __init__(self, limits: Sequence[float]) -> None:
        """Start with none; ``limits`` are those of the actuated axes [N m] or [N], (n_theta,)."""
        self.tau = np.zeros(len(limits))
        self._tolerance = _AGREEMENT * np.array(limits)
        self._waiting: deque[Torque] = deque(maxlen=_MOST_WAITING)
        self._measured: Array | None = None
        self._is_measured = self._is_told = False

    def tell(self, torque: Torque) -> None:
        """Take what the guard let through."""
        self._waiting.append(torque)

    def measure(self, tau: Array | None) -> None:
        """Take what the drives measured until the next step, (n_theta,); None when it cannot be used."""
        self._measured, self._is_measured = tau, tau is not None

    def changes_before(self, stamp_ns: int, last_ns: int | None) -> Sequence[Torque]:
        """Go on to ``stamp_ns`` [ns]; return the torques that began since ``last_ns``, in order of time.

        ``tau`` is then what acted until the first of them; the caller goes through them.
        """
        if last_ns is not None and stamp_ns < last_ns:  # set back: what waits is of another time
            self._waiting = deque((t for t in self._waiting if t.stamp_ns <= stamp_ns), maxlen=_MOST_WAITING)
        begun = sorted((t for t in self._waiting if t.stamp_ns < stamp_ns), key=attrgetter("stamp_ns"))
        self._waiting = deque((t for t in self._waiting if t.stamp_ns >= stamp_ns), maxlen=_MOST_WAITING)
        self._is_told |= bool(begun)
        if not self._is_told and self._measured is not None:
            self.tau = self._measured  # no guard tells what it lets through
        older = [t for t in begun if last_ns is None or t.stamp_ns <= last_ns]
        self.tau = older[-1].tau if older else self.tau
        return [] if self._is_contradicted(begun) else begun[len(older) :]

    def _is_contradicted(self, begun: Sequence[Torque]) -> bool:
        """Return whether the drives measured another torque than was told last, and go on with theirs."""
        is_measured, self._is_measured = self._is_measured, False
        if not is_measured or self._measured is None:
            return False
        told = begun[-1].tau if begun else self.tau
        is_other = bool((abs(told - self._measured) > self._tolerance).any())
        self.tau = self._measured if is_other else self.tau
        return is_other
