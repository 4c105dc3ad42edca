"""Inputs that move in a run: what a channel says while another input is driven is noise of its sensor.

Whether a test is of hits or of sweeps is asked of the inputs that move. A channel that rests says noise,
which is neither, so it is compared with what it says where it is driven.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IDLE = 0.05  # of the widest swing of a channel in any run, below which it rests in this one


def moving_inputs(runs: Sequence[Mapping[str, Array]]) -> list[tuple[int, str, Array]]:
    """Return the inputs that move, each with the number of its run and its name.

    Args:
        runs: Inputs of every run by name, (samples,) each.
    """
    widest: dict[str, float] = {}
    for run in runs:
        for name, x in run.items():
            widest[name] = max(widest.get(name, 0.0), float(np.ptp(x)))
    return [
        (k, name, x)
        for k, run in enumerate(runs)
        for name, x in run.items()
        if np.ptp(x) > IDLE * widest[name]
    ]
