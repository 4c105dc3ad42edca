"""What the coming reference adds to the gradient of the program, worked out for several periods at once.

The window of the reference moves on by one period from step to step; ``Q_r r`` of several windows is one
product of matrices, which takes a fraction of the time of as many products with vectors.
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from flexarm_controller.reference import Reference

Array = NDArray[np.float64]
WINDOWS = 16  # worked out together; more of them would make the step in which it happens late
SAME_INSTANT = 1e-9  # s; stamps are whole nanoseconds


class Preview:
    """``Q_r [r_0; ...; r_N]`` with the samples ``r = [theta; theta'; theta'']`` from an instant on."""

    def __init__(self, Q_r: Array, horizon: int, dt: float) -> None:
        """Prepare for windows of ``horizon + 1`` samples, ``dt`` [s] apart; Q_r is (n, (N + 1) n_r)."""
        self._Q_t, self._dt = np.ascontiguousarray(Q_r.T), dt
        self._count = horizon + 1
        self._offsets = np.arange(self._count + WINDOWS - 1.0) * dt
        self._reference: Reference | None = None
        self._start, self._gradients = 0.0, np.zeros((WINDOWS, Q_r.shape[0]))

    def gradient(self, reference: Reference, t: float) -> Array:
        """Return the gradient for the window that begins at ``t`` [s], (n,); read-only."""
        periods = (t - self._start) / self._dt
        window = round(periods) if 0.0 <= periods + 0.5 < WINDOWS else -1
        is_known = reference is self._reference and window >= 0
        if not is_known or abs(t - self._start - window * self._dt) > SAME_INSTANT:
            self._work_out(reference, t)
            window = 0
        row: Array = self._gradients[window]
        return row

    def _work_out(self, reference: Reference, t: float) -> None:
        self._reference, self._start = reference, t
        samples = np.hstack(reference.sample(t + self._offsets))  # (count + WINDOWS - 1, n_r)
        windows = sliding_window_view(samples, self._count, axis=0).swapaxes(1, 2)
        self._gradients = windows.reshape(WINDOWS, -1) @ self._Q_t
        self._gradients.flags.writeable = False
