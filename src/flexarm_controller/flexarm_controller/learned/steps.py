"""What is learned, in steps: it trembles with the noise, and every other model costs a program."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
LEAVE = 0.75  # steps away from the present one at which the nearest takes over: half would be no hysteresis
LOWEST, HIGHEST = -0.6, 1.0  # believed of a relative error; beyond it something else is wrong


def follow_steps(at: tuple[int, ...], learned: Array, size: float) -> tuple[int, ...]:
    """Return the steps that stand for what was learned.

    Args:
        at: The present ones; of another length where there are none yet.
        learned: Relative errors [1], (n,); what is not a number changes nothing.
        size: Of a step [1].
    """
    now = at if len(at) == learned.size else (0,) * learned.size
    wanted = (np.clip(learned, LOWEST, HIGHEST) / size).tolist()
    return tuple(round(w) if abs(w - k) > LEAVE else k for w, k in zip(wanted, now, strict=True))
