"""Which torque acted in every period: the one that the guard sent for it, or still the one before.

The guard says what it sends and for which period (``applied_effort``). Under load an answer comes when its
period is over, and the drive has held the torque before; then the input of an identification is wrong by the
difference. What the drives measured (``effort`` of ``joint_states``, of the period before its stamp) tells
the two apart. Only that is taken from it: what acts is one of the torques sent, without the noise and the
delay of a current sensor.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Heard = tuple[Array, Array]
"""Times [s] and values, in order."""


def acted(sent: Heard, measured: Heard, dt: float) -> Heard:
    """Return the torque of an axis from the begin of every period on [s], [N m or N].

    Args:
        sent: For the period that begins then.
        measured: By the drive in the period that begins then; periods in which it says nothing are
            believed to have had what was sent.
        dt: Period [s].
    """
    t, tau = sent[0], sent[1].copy()
    if not (t.size and measured[0].size):
        return t, tau
    near = np.clip(np.searchsorted(measured[0], t - dt / 2), 0, measured[0].size - 1)
    is_told = abs(measured[0][near] - t) < dt / 2
    said = measured[1][near]
    for k in range(1, t.size):
        if is_told[k] and abs(said[k] - tau[k - 1]) < abs(said[k] - tau[k]):
            tau[k] = tau[k - 1]
    return t, tau
