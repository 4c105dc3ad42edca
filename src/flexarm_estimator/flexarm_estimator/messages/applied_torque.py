"""Which torque acted when: as the guard tells it, or as the drives measure it where no guard does.

What the guard tells is what it wants, without noise and in time. Where the drives measured something else, it
was not the guard who spoke, or the drives did not obey; then the drives are right, until they agree closely
with what is told: drives that brake by themselves pass what a guard wants from them on their way to rest. A
period without a measurement, or two, changes nothing about that: where forged torques flood the loop, one of
them would act in each. Of a guard that has fallen silent the last word does not act any more.
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
_AGREEMENT = 0.05  # share of the torque limit by which drives may measure another torque than was told
_AGAIN = 0.01  # the same for drives that did not obey before
_SILENCE = 50_000_000  # ns after which what guard or drives told last is not what acts


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
        self._limits = np.array(limits)
        self._waiting: deque[Torque] = deque(maxlen=_MOST_WAITING)
        self._told: Torque | None = None
        self._measured: Array | None = None
        self._measured_ns = 0
        self._disobeyed = False

    def tell(self, torque: Torque) -> None:
        """Take what the guard let through."""
        self._waiting.append(torque)

    def measure(self, tau: Array | None) -> None:
        """Take what the drives measured until the next step, (n_theta,); None when it cannot be used."""
        self._measured = tau

    def changes_before(self, stamp_ns: int, last_ns: int | None) -> Sequence[Torque]:
        """Go on to ``stamp_ns`` [ns]; return the torques that began since ``last_ns``, in order of time.

        ``tau`` is then what acted until the first of them; the caller goes through them.
        """
        if last_ns is not None and stamp_ns < last_ns:  # set back: what waits is of another time
            self._waiting = deque((t for t in self._waiting if t.stamp_ns <= stamp_ns), maxlen=_MOST_WAITING)
        begun = sorted((t for t in self._waiting if t.stamp_ns < stamp_ns), key=attrgetter("stamp_ns"))
        self._waiting = deque((t for t in self._waiting if t.stamp_ns >= stamp_ns), maxlen=_MOST_WAITING)
        older = [t for t in begun if last_ns is None or t.stamp_ns <= last_ns]
        self._told = begun[-1] if begun else self._told
        disobeyed = self._disobeyed
        if self._believe_drives(stamp_ns):
            return []
        if older:
            self.tau = older[-1].tau
        elif self._told is not None and disobeyed and not (begun or self._disobeyed):
            self.tau = self._told.tau
        return begun[len(older) :]

    def _believe_drives(self, stamp_ns: int) -> bool:
        """Go on with what the drives measured if it is not what was told; return whether it is not."""
        told, measured = self._told, self._measured
        self._measured = None
        if measured is None:
            return self._disobeyed and 0 <= stamp_ns - self._measured_ns <= _SILENCE
        self._measured_ns = stamp_ns
        if told is not None:
            tolerance = (_AGAIN if self._disobeyed else _AGREEMENT) * self._limits
            is_silent = not 0 < stamp_ns - told.stamp_ns <= _SILENCE
            self._disobeyed = is_silent or bool((abs(told.tau - measured) > tolerance).any())
            if not self._disobeyed:
                return False
        self.tau = measured
        return True
