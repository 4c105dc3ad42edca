"""Which torque acted when: as the guard tells it, or as the drives measure it where no guard does."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_MOST_WAITING = 200  # torques


@dataclass(frozen=True)
class Torque:
    """A torque that acts from ``stamp_ns`` on, (n_theta,)."""

    stamp_ns: int
    tau: Array


class AppliedTorque:
    """Torques told so far, and the one that acts."""

    def __init__(self, n_theta: int) -> None:
        """Start with none; ``n_theta`` actuated axes."""
        self.tau = np.zeros(n_theta)
        self._waiting: deque[Torque] = deque(maxlen=_MOST_WAITING)
        self._measured: Array | None = None
        self._is_told = False

    def tell(self, torque: Torque) -> None:
        """Take what the guard let through."""
        self._waiting.append(torque)

    def measure(self, tau: Array | None) -> None:
        """Take what the drives measured, (n_theta,); None when it cannot be used."""
        self._measured = tau

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
        return begun[len(older) :]
