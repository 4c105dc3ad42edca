"""Extra-insensitive shapers: a little vibration is allowed so that more frequencies stay below it.

What n impulses leave of the vibration of one impulse, at frequency ``w`` in units of the designed one::

    V(w) = |f(w)|    f(w) = sum A_i exp(w s (t_i - t_n))    s = zeta omega + i omega sqrt(1 - zeta^2)

V has n - 1 zeros and between two of them a hump. All humps are as high as the tolerance; the middle one
(EI: one hump, three-hump EI) or the middle zero (two-hump EI) is at w = 1. Sum of amplitudes, zeros and
humps are 4 n - 4 equations for as many unknowns. Without damping they have the closed forms printed in
[Singhose1994] (EI) and [Singhose1997] (two and three humps); from there the damping ratio is raised in
steps. The published damped shapers are polynomials fitted to the same solutions (their times are in
undamped periods); above a damping ratio of about 0.4 there are no positive ones.

Duration: 1 (EI), 1.5 and 2 damped periods. Half-width below 5 %: 20, 36 and 48 % of the frequency.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_model.motion.shapers import Shaper, half_damped_period

Array = NDArray[np.float64]
TOLERANCE = 0.05  # of the vibration of one impulse [1]: usual in the literature
STEP = 0.05  # of the damping ratio between two solutions
SOLVED = 1e-9  # residual of the equations [1]


def ei(omega: float, zeta: float, tolerance: float = TOLERANCE) -> Shaper:
    """Return the extra-insensitive shaper of a mode with ``omega`` [rad/s] and ``zeta`` [1].

    Args:
        omega: Undamped frequency.
        zeta: Damping ratio.
        tolerance: Vibration that is left at ``omega`` itself, of that of one impulse [1].

    Raises:
        ValueError: A value is out of range, or there is no shaper of positive impulses.
    """
    V = tolerance
    return _damped("EI", omega, zeta, V, ((1 + V) / 4, (1 - V) / 2, (1 + V) / 4))


def two_hump(omega: float, zeta: float, tolerance: float = TOLERANCE) -> Shaper:
    """Return the two-hump extra-insensitive shaper; arguments and errors as of ``ei``."""
    V = tolerance
    X = (V**2 * (math.sqrt(max(1 - V**2, 0.0)) + 1)) ** (1 / 3)
    outer = (3 * X**2 + 2 * X + 3 * V**2) / (16 * X) if X > 0.0 else 0.0
    return _damped("two-hump EI", omega, zeta, V, (outer, 0.5 - outer, 0.5 - outer, outer))


def three_hump(omega: float, zeta: float, tolerance: float = TOLERANCE) -> Shaper:
    """Return the three-hump extra-insensitive shaper; arguments and errors as of ``ei``."""
    V = tolerance
    outer, second = (1 + 3 * V + 2 * math.sqrt(max(2 * (V**2 + V), 0.0))) / 16, (1 - V) / 4
    return _damped("three-hump EI", omega, zeta, V, (outer, second, 1 - 2 * (outer + second), second, outer))


def _damped(name: str, omega: float, zeta: float, V: float, undamped: tuple[float, ...]) -> Shaper:
    half_period = half_damped_period(omega, zeta)
    if not 0.0 < V < 1.0:
        raise ValueError(f"{name}: tolerance = {V} must be in (0, 1)")
    amplitudes, halves = _solve(name, zeta, V, undamped)
    return Shaper(name, tuple(h * half_period for h in halves), amplitudes)


@lru_cache(maxsize=256)
def _solve(
    name: str, zeta: float, V: float, undamped: tuple[float, ...]
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return amplitudes and times in half damped periods, starting from the undamped amplitudes."""
    n = len(undamped)
    unknown = _undamped_solution(np.array(undamped))
    for ratio in np.linspace(0.0, zeta, math.ceil(zeta / STEP) + 1):
        with np.errstate(all="ignore"):  # where there is no solution, trial steps overflow
            unknown = scipy.optimize.root(_equations, unknown, args=(n, float(ratio), V), tol=1e-13).x
            is_solved = bool(abs(_equations(unknown, n, float(ratio), V)).max() < SOLVED)
    amplitudes, halves = unknown[:n], np.concatenate([[0.0], unknown[n : 2 * n - 1]])
    if not (is_solved and amplitudes.min() > 0.0 and np.diff(halves).min() > 0.0):
        raise ValueError(f"{name}: no positive impulses for zeta = {zeta} and tolerance {V}")
    return tuple(map(float, amplitudes)), tuple(map(float, halves))


def _undamped_solution(amplitudes: Array) -> Array:
    """Return ``[A; t_2 ... t_n; zeros; humps]``: half a period apart, zeros are roots of a polynomial."""
    zeros = np.sort(np.angle(np.roots(amplitudes)) % (2 * np.pi)) / np.pi
    return np.concatenate([amplitudes, np.arange(1.0, amplitudes.size), zeros, (zeros[1:] + zeros[:-1]) / 2])


def _equations(unknown: Array, n: int, zeta: float, V: float) -> Array:
    """Return what is left of the 4 n - 4 equations."""
    A, t, zeros, humps = np.split(unknown, [n, 2 * n - 1, 3 * n - 2])
    slope = np.pi * complex(zeta / math.sqrt(1 - zeta**2), 1.0)
    delays = slope * (np.concatenate([[0.0], t]) - t[-1])  # (n,)
    at_zeros = np.exp(np.outer(zeros, delays)) @ A
    at_humps = np.exp(np.outer(humps, delays))
    height, change = at_humps @ A, at_humps @ (A * delays)
    middle = zeros[(n - 1) // 2] if n % 2 == 0 else humps[(n - 2) // 2]
    return np.concatenate([
        [A.sum() - 1.0, middle - 1.0], at_zeros.real, at_zeros.imag,
        abs(height) - V, (np.conj(height) * change).real,
    ])  # fmt: skip
