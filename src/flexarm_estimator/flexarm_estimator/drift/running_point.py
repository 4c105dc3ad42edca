"""The point about which the watch is linear: the served model with the stiffness that its modes run with.

Innovations are regressed on their slopes, and slopes hold near the point where they were taken. A mode that
runs ten per cent away rings beside the filter's notch for it, where a slope still shows the way and no longer
how far. So the filter goes along, a step of Gauss and Newton at a time, until what is left is small. Damping
ratios stay as they are, so that ``2 zeta omega`` moves with the frequency::

    omega_running = omega sqrt(r)          (K, D)_mode = (r omega^2, 2 zeta sqrt(r) omega)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.drift.judgement import ModeNow
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
REACH = 0.02  # change of a frequency within which its slope is as good as at the point itself [1]
SIGMAS, BOLD = 3.0, 1.0  # of a change that is followed; of one that shows as damping, too
LONGEST = 0.2  # of a step: farther away a slope does not see [1]
FAR = 0.07  # from the point: whatever is read of other modes meanwhile is not to be followed [1]
RANGE = (0.45, 1.7)  # of a running frequency over the described one [1]
LASTING = 1.1  # s that a mode reads far from the point before it is followed: a knock is over by then
SETTLED = 2.0  # s after a step until a reading is believed


class RunningPoint:
    """Running over described frequency of every watched mode at the point, and since when it is there."""

    def __init__(self, names: Sequence[str]) -> None:
        """Begin as described."""
        self._names = list(names)
        self.ratio: Array = np.ones(len(names))
        self._stepped = np.full(len(names), -np.inf)
        self._left: dict[str, float] = {}

    def step(self, modes: Sequence[ModeNow], t: float) -> Array | None:
        """Go to where modes run; return the relative change of every stiffness, or None when all are near.

        Args:
            modes: That are judged; others stay.
            t: Time of motion [s].
        """
        left = [mode.name for mode in modes if self._has_left(mode)]
        self._left = {name: min(self._left.get(name, t), t) for name in left}  # a clock may be set back
        wanted = self.ratio.copy()
        for mode in self._first([mode for mode in modes if t - self._left.get(mode.name, t) >= LASTING]):
            at = self._names.index(mode.name)
            step = np.clip(self._away(mode), -LONGEST, LONGEST)
            wanted[at] = np.clip(wanted[at] * (1.0 + step), *RANGE)
        moved = wanted != self.ratio
        if not moved.any():
            return None
        shift: Array = (wanted / self.ratio) ** 2 - 1.0
        self.ratio, self._stepped[moved], self._left = wanted, t, {}
        return shift

    def settled(self, modes: Sequence[ModeNow], t: float) -> tuple[ModeNow, ...]:
        """Return all watched modes with whether the reading is near the point, and has been for a while."""
        found = []
        for mode, ratio, stepped in zip(modes, self.ratio, self._stepped, strict=True):
            is_inside = RANGE[0] < ratio < RANGE[1] and not 0.0 <= t - stepped < SETTLED
            found.append(replace(mode, is_settled=is_inside and not self._has_left(mode)))
        return tuple(found)

    def _first(self, modes: list[ModeNow]) -> list[ModeNow]:
        """Return those to follow now: one that is far away spoils what is read of the others."""
        if all(abs(self._away(mode)) < FAR for mode in modes):
            return modes
        return [max(modes, key=lambda mode: abs(self._away(mode)) / mode.drift_sigma)]

    def _has_left(self, mode: ModeNow) -> bool:
        sigmas = BOLD if mode.is_damped else SIGMAS
        return abs(self._away(mode)) > max(REACH, sigmas * mode.drift_sigma)

    def _away(self, mode: ModeNow) -> float:
        """Return how far a mode runs from the point [1]."""
        return (1.0 + mode.drift) / float(self.ratio[self._names.index(mode.name)]) - 1.0


def running_model(model: ReducedModel, modes: Sequence[int], ratio: Array) -> ReducedModel:
    """Return a served model whose modes run elsewhere.

    Args:
        model: As served.
        modes: Places of the modes among all.
        ratio: Running over described frequency of each [1], (modes,).
    """
    if (ratio == 1.0).all():
        return model
    every = np.ones(model.n_eta)
    every[list(modes)] = ratio
    K, D, at = model.K.copy(), model.D.copy(), np.arange(model.n_theta, model.n)
    K[at, at] *= every**2
    D[at, at] *= every
    return replace(model, K=K, D=D, omega=model.omega * every)
