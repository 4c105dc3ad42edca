"""What the noise of encoders does to a regression on their positions and velocities.

White noise of sigma ``s`` at a period dt behind a Butterworth low-pass of order n at f, run forwards and
backwards, and its derivatives; ``x^(p-1) / (1 + x^2n)^2`` integrates to ``c_p``::

    s_q^2 = 2 f dt s^2 c_1     s_v^2 = 2 f dt s^2 (2 pi f)^2 c_3     s_a^2 = 2 f dt s^2 (2 pi f)^4 c_5
    c_p = (1 - p / 2n) (pi / 2n) / sin(p pi / 2n)

Velocities must be surer than the slope of Coulomb friction, or its sign is blurred: that bounds the cut-off
of the positions. A regressor with noise of variance ``s_q^2`` makes its square too large by that and its
parameter too small; the square is put right [Soderstrom2007].
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_model.identification.noise_floor import noise_floor

Array = NDArray[np.float64]
ORDER = 4  # of the low-passes
BLUR = 0.5  # of the slope of friction: largest noise of a velocity


def white_noise(q: Array) -> Array:
    """Return the standard deviation of the white part of every column, (n_axes,)."""
    return np.array([noise_floor(column) for column in q.T])


def smoothest(sigma: Array, dt: float, slope: float) -> float:
    """Return the cut-off [Hz] at which the noisiest velocity is as sure as friction needs.

    Args:
        sigma: Of the positions [rad or m], (n_axes,).
        dt: Sample period [s].
        slope: Velocity over which friction turns its sign [rad/s or m/s].
    """
    noisiest = float(sigma.max())
    if noisiest == 0.0:
        return np.inf
    return float(((BLUR * slope) ** 2 / (8.0 * np.pi**2 * noisiest**2 * dt * _passed(3))) ** (1 / 3))


def left_behind(sigma: Array, cutoff_hz: float, dt: float) -> tuple[Array, Array, Array]:
    """Return the variances of position, velocity and acceleration behind a low-pass, (n_axes,) each."""
    all_of_it, square = 2.0 * cutoff_hz * dt * sigma**2, (2.0 * np.pi * cutoff_hz) ** 2
    return all_of_it * _passed(1), all_of_it * square * _passed(3), all_of_it * square**2 * _passed(5)


def _passed(p: int) -> float:
    """Return ``c_p``."""
    share = p / (2 * ORDER)
    return float((1.0 - share) * np.pi / (2 * ORDER) / np.sin(np.pi * share))
