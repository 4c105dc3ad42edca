"""Which torque acted when in a recorded bag, by the rule that the estimator keeps to while it runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.messages.applied_torque import AppliedTorque, Torque

Array = NDArray[np.float64]


def acting_torques(
    told: Mapping[int, Array], measured: Mapping[int, Array | None], limits: Sequence[float]
) -> list[Torque]:
    """Return the torques that acted, in order of time; zero acts before the first.

    Args:
        told: By the guard, (n_theta,) each, by the stamp from which on it acts [ns].
        measured: By the drives, (n_theta,) each, by the stamp up to which it acted [ns]; None where what they
            say cannot be used.
        limits: Torque limits of the actuated axes [N m] or [N], (n_theta,).
    """
    acting, last_ns = AppliedTorque(limits), None
    stamps = sorted({*told, *measured})
    began = [Torque(0, acting.tau)]
    for stamp_ns in (*stamps, *(stamp + 1 for stamp in stamps[-1:])):
        if stamp_ns in measured:
            acting.measure(measured[stamp_ns])
        acting.changes_before(stamp_ns, last_ns)  # none later than the last stamp: every stamp is gone to
        if (acting.tau != began[-1].tau).any():
            began.append(Torque(last_ns or 0, acting.tau))
        if stamp_ns in told:
            acting.tell(Torque(stamp_ns, told[stamp_ns]))
        last_ns = stamp_ns
    return began[1:]
