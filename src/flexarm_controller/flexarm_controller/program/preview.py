"""What the coming reference adds to the gradient of the program, worked out for several periods at once.

The window of the reference moves on by one period from step to step; ``Q_r r`` of several windows is one
product of matrices, which takes a fraction of the time of as many products with vectors. So does what
follows from the gradients.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.lib.stride_tricks import as_strided
from numpy.typing import NDArray

from flexarm_controller.reference import Reference

Array = NDArray[np.float64]
WINDOWS = 16  # worked out together; more of them would make the step in which it happens late
SAME_INSTANT = 1e-9  # s; stamps are whole nanoseconds


class Preview:
    """``Q_r [r_0; ...; r_N]`` with the samples ``r = [theta; theta'; theta'']`` from an instant on."""

    def __init__(self, Q_r: Array, horizon: int, dt: float, follow: Callable[[Array], Array]) -> None:
        """Prepare.

        Args:
            Q_r: Gradient per sample of the reference, (n, (N + 1) n_r).
            horizon: Samples of a window, less one.
            dt: Time between them [s].
            follow: What is to be worked out from gradients, (k, n) -> (k, m).
        """
        self._Q_t, self._dt, self._follow = np.ascontiguousarray(Q_r.T), dt, follow
        self._count = horizon + 1
        self._offsets = np.arange(self._count + WINDOWS - 1.0) * dt
        self._reference: Reference | None = None
        self._start = 0.0
        self._gradients = self._following = np.zeros((0, 0))

    def look(self, reference: Reference, t: float) -> tuple[Array, Array]:
        """Return gradient (n,) and what follows (m,) for the window that begins at ``t`` [s]; read-only."""
        periods = (t - self._start) / self._dt
        window = round(periods) if 0.0 <= periods + 0.5 < WINDOWS else -1
        is_known = reference is self._reference and window >= 0
        if not is_known or abs(t - self._start - window * self._dt) > SAME_INSTANT:
            self._work_out(reference, t)
            window = 0
        return self._gradients[window], self._following[window]

    def _work_out(self, reference: Reference, t: float) -> None:
        self._reference, self._start = reference, t
        samples = reference.stacked(t + self._offsets)  # (count + WINDOWS - 1, n_r)
        row, one = samples.strides
        windows = as_strided(samples, (WINDOWS, len(self._Q_t)), (row, one))  # each is a row further on
        self._gradients = windows @ self._Q_t
        self._following = self._follow(self._gradients)
        self._gradients.flags.writeable = self._following.flags.writeable = False
