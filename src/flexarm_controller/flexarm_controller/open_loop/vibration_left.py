"""What a motion leaves of the vibration of the served modes when the axes follow it exactly.

With the axes locked onto the motion each mode is an oscillator, ``eta'' + 2 zeta omega eta' + omega^2 eta =
-M_et theta''``. The acceleration is constant over each period, so with ``p = -zeta omega + i omega_d`` the
amplitude at the end of N periods is a sum::

    a = -(e^{p dt} - 1) / (p dt) sum_k e^{p dt (N - 1 - k)} M_et (theta'_{k+1} - theta'_k)

``eta''`` then rings with ``omega |a|`` and dies out with ``e^{-zeta omega t}``. Added up at the tip over the
window, each mode by itself, low-passed as reports do (Butterworth, forward and backward).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.open_loop.axis_motion import Motion
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
ORDER = 4  # of the low-pass


@dataclass(frozen=True)
class Window:
    """When and up to which frequency vibration counts: after the motion [s], [s], [Hz]."""

    begin: float
    end: float
    cutoff_hz: float


class VibrationLeft:
    """Predicts the vibration at the tip.

    Attributes:
        omega: Frequencies of the modes [rad/s], (n_eta,).
        zeta: Damping ratios [1], (n_eta,).
    """

    def __init__(self, model: ReducedModel, window: Window, dt: float, frequency_scale: float = 1.0) -> None:
        """Look at the modes of ``model``, all frequencies times ``frequency_scale``; dt is the period [s]."""
        m = model.n_theta
        self.omega, self.zeta, self._dt = model.omega * frequency_scale, model.zeta, dt
        self._push = model.M[m:, :m]  # (n_eta, n_theta)
        rows = model.outputs.rows("tip")[:3]
        at_tip = np.linalg.norm(model.outputs.C_pos[rows, m:], axis=0)
        passed = 1.0 / (1.0 + (self.omega / (2 * np.pi * window.cutoff_hz)) ** (2 * ORDER))
        decay = 2 * self.zeta * self.omega
        lasting = (np.exp(-decay * window.begin) - np.exp(-decay * window.end)) / (
            np.maximum(decay, np.finfo(float).tiny) * (window.end - window.begin)
        )
        self._seen = at_tip * passed * self.omega * np.sqrt(np.where(decay > 0.0, lasting, 1.0) / 2)
        self._pole = self.omega * np.where(
            self.zeta < 1.0,
            -self.zeta + 1j * np.sqrt(np.maximum(1 - self.zeta**2, 0.0)),
            -self.zeta + np.sqrt(np.maximum(self.zeta**2 - 1, 0.0)),  # the slower of two decays
        )

    def by_mode(self, motion: Motion) -> Array:
        """Return the acceleration that each mode leaves at the tip, RMS over the window [m/s^2], (n_eta,)."""
        periods = max(int(np.ceil(motion.duration / self._dt - 1e-9)), 1)
        _, velocity, _ = motion.sample(np.arange(periods + 1.0) * self._dt)
        change = np.diff(velocity, axis=0)
        change[-1] -= velocity[-1]  # what is still moving at the last tick stops there
        step = self._pole * self._dt
        since_end = np.arange(periods - 1, -1, -1)
        amplitude = (np.exp(np.outer(step, since_end)) * (self._push @ change.T)).sum(axis=1)
        return np.asarray(self._seen * abs(amplitude * np.expm1(step) / step))

    def rms(self, motion: Motion) -> float:
        """Return the acceleration that is left at the tip, RMS over the window [m/s^2]."""
        return float(np.linalg.norm(self.by_mode(motion)))
