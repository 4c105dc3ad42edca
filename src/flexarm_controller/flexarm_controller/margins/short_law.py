"""A law that acts for a short time only: by how much vibration may have grown when it ends.

It need not be stable: what it begins, the ordinary law ends. Its loop ``z+ = A z`` is looked at for the
``k = ceil(T / dt)`` periods that it may last, in two ways, for motions that go on and for those that begin::

    growth     max_i |lambda_i(A)|^k
    kicked     max_{j <= k} || S A^j z_m ||  over the same of the ordinary law, or over one

``z_m`` is mode m swinging with unit energy in its worst phase, nothing of it known to the filter yet; ``S``
takes the elastic modes out of the state, in which energy is a sum of squares. The second sees also what
eigenvalues do not: vibration that a law which holds the axes firmly hands from mode to mode. It is compared
with the most that the ordinary law lets follow with any frequency error, as what a sampled sensor makes of a
mode faster than half the control rate hangs on the exact frequency.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.margins.case import strongest
from flexarm_controller.margins.loop import ClosedLoop
from flexarm_controller.margins.response import decompose
from flexarm_model.settings.units import RAD_PER_HZ

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ShortCase:
    """What a short law does at one pose with one frequency error.

    Attributes:
        pose: Of the actuated axes [rad or m], (n_theta,).
        frequency_error: Real over described frequency, minus one [1].
        lasts: Longest time for which the law acts [s].
        growth: Factor by which the fastest growing motion grows in that time [1].
        mode: Mode that takes part in it most, by name; "axes" when it is none.
        frequency: Of that motion as sampled [Hz].
        kicked: Largest amplitude of a kicked mode's vibration, by its name; over the ordinary law's [1].
    """

    pose: tuple[float, ...]
    frequency_error: float
    lasts: float
    growth: float
    mode: str
    frequency: float
    kicked: dict[str, float]


def examine_short(
    loops: Mapping[float, ClosedLoop], ordinary: Iterable[ClosedLoop], pose: Array, lasts: float, dt: float
) -> list[ShortCase]:
    """Examine the loops of a short law.

    Args:
        loops: Of that law with the full plant, by frequency error [1].
        ordinary: Of the law that follows it, with the same plants.
        pose: Where they were linearised, (n_theta,).
        lasts: How long it acts, at most [s].
        dt: Control period [s].

    Raises:
        LinAlgError: A loop cannot be diagonalised.
    """
    periods = _count(lasts, dt)
    allowed = np.maximum(np.max([_kicked(loop, periods) for loop in ordinary], axis=0), 1.0)
    found = []
    for error, loop in loops.items():
        modes = decompose(loop.A)
        worst = int(abs(modes.values).argmax())
        kicked = _kicked(loop, periods) / allowed
        found.append(
            ShortCase(
                tuple(float(value) for value in pose),
                error,
                lasts,
                float(abs(modes.values[worst]) ** periods),
                strongest(modes, loop, worst),
                float(abs(np.angle(modes.values[worst])) / dt / RAD_PER_HZ),
                dict(zip(_elastic(loop)[1], kicked.tolist(), strict=True)),
            )
        )
    return found


def _count(lasts: float, dt: float) -> int:
    """Return how many periods last so long."""
    return max(math.ceil(lasts / dt - 1e-9), 1)


def _elastic(loop: ClosedLoop) -> tuple[Array, list[str]]:
    """Return numbers and names of the plant's modes that are no motions of the axes."""
    kept = [(j, name) for j, name in enumerate(loop.plant.names) if name.startswith("mode")]
    return np.array([j for j, _ in kept], int), [name for _, name in kept]


def _kicked(loop: ClosedLoop, periods: int) -> Array:
    """Return the largest amplitude that follows unit energy in every elastic mode, in its worst phase."""
    n, (which, _) = len(loop.plant.names), _elastic(loop)
    rows = np.concatenate([which, n + which])
    z = np.zeros((which.size, len(loop.A), 2))
    for i, j in enumerate(which.tolist()):
        z[i, j, 0] = z[i, n + j, 1] = 1.0
    largest = np.zeros(which.size)
    for _ in range(periods):
        z = loop.A @ z
        largest = np.maximum(largest, np.linalg.norm(z[:, rows], 2, axis=(1, 2)))
    return np.asarray(largest)
