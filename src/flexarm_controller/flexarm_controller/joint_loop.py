"""The served model under feedback of its axes, with the delay of the rig, period by period."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.program.prediction import plant
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
GAIN_MARGIN = 2.0  # 6 dB that a joint loop is to bear
SLOW = 1e-4  # rad per period: slower than this a pole does not ring, it drifts
ROUNDED = 1e-6  # of a pole's magnitude


class JointLoop:
    """``tau = -K_p theta - K_d theta'`` of the instant ``delay`` periods before."""

    def __init__(self, model: ReducedModel, dt: float, delay: int) -> None:
        """Close the loop round ``model`` with a period of ``dt`` [s]."""
        self._system, self._delay, self._dt = plant(model, dt), delay, dt
        self._n_theta = model.n_theta

    def is_stable(self, K_p: Array, K_d: Array) -> bool:
        """Tell whether ``[x; torques on their way]`` dies out; gains of the axes, (n_theta,)."""
        return bool(abs(self._poles(K_p, K_d)).max() < 1.0)

    def bears(self, K_p: Array, K_d: Array) -> bool:
        """Tell whether it is stable with the gains (n_theta,), and with twice of them.

        Against gravity or springs that push an axis away, less gain may be unstable where more is not.
        """
        return self.is_stable(GAIN_MARGIN * K_p, GAIN_MARGIN * K_d) and self.is_stable(K_p, K_d)

    def culprit(self, K_p: Array, K_d: Array) -> int:
        """Return the axis whose gains (n_theta,) make the pole that grows fastest grow most."""
        poles, shapes = np.linalg.eig(self._closed(K_p, K_d))
        worst = int(np.argmax(abs(poles)))
        left, shape = np.linalg.inv(shapes)[worst], shapes[:, worst]
        idle = self._closed(0.0 * K_p, 0.0 * K_d)
        own = [self._closed(axis * K_p, axis * K_d) - idle for axis in np.eye(self._n_theta)]
        return int(np.argmax([(np.conj(poles[worst]) * (left @ part @ shape)).real for part in own]))

    def ringing_hz(self, K_p: Array, K_d: Array) -> float:
        """Return the frequency of the pole that grows fastest with gains (n_theta,) [Hz]; 0: it drifts."""
        poles = self._poles(K_p, K_d)
        angle = abs(np.angle(poles[np.argmax(abs(poles))]))
        return float(angle / (2 * np.pi * self._dt)) if angle > SLOW else 0.0

    def rings(self, K_d: Array) -> bool:
        """Tell whether damping alone, (n_theta,), makes anything ring up; where it drifts to is left open."""
        poles = self._poles(0.0 * K_d, K_d)
        return bool(((abs(poles) > 1.0 + ROUNDED) & (abs(np.angle(poles)) > SLOW)).any())

    def _poles(self, K_p: Array, K_d: Array) -> Array:
        return np.asarray(np.linalg.eigvals(self._closed(K_p, K_d)))

    def _gain(self, K_p: Array, K_d: Array) -> Array:
        s, m = self._system, self._n_theta
        gain = np.zeros((m, s.n_x))
        gain[:, :m], gain[:, s.n_x // 2 : s.n_x // 2 + m] = np.diag(K_p), np.diag(K_d)
        return gain

    def _closed(self, K_p: Array, K_d: Array) -> Array:
        """Return the step of ``[x; torques on their way]``."""
        s, m, gain = self._system, self._n_theta, self._gain(K_p, K_d)
        n_x, n_w = s.n_x, self._delay * m
        A = np.zeros((n_x + n_w, n_x + n_w))
        A[:n_x, :n_x] = s.A if n_w else s.A - s.B @ gain
        if n_w:
            A[:n_x, n_x : n_x + m] = s.B  # the oldest torque acts
            A[n_x : n_x + n_w - m, n_x + m :] = np.eye(n_w - m)
            A[n_x + n_w - m :, :n_x] = -gain
        return A
