"""Open-loop runs on an ideal servo: the axis does what it is told, the arm rings as it will."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexarm_bringup.motions import Move, sample_moves
from flexarm_bringup.record import RunRecord
from flexarm_bringup.sim.rig import Rig


def run_servo(rig: Rig, moves: Sequence[Move]) -> RunRecord:
    """Move the axis as prescribed and return what happened.

    The acceleration of a period is the change of the prescribed velocity, so the velocity is exact at
    every tick.

    Args:
        rig: A rig at tick 0.
        moves: The series.
    """
    n = round(moves[-1].slot_end / rig.dt)
    times = np.asarray(np.arange(n + 1) * rig.dt, dtype=np.float64)
    _, velocity, _ = sample_moves(moves, times)
    acceleration = np.diff(velocity) / rig.dt
    truths = [rig.truth()]
    for value in acceleration:
        rig.servo(np.array([value]))
        truths.append(rig.truth())
    nothing = np.full((n + 1, 0), np.nan)
    return RunRecord(
        t=times,
        theta=np.array([truth.theta for truth in truths]),
        tip=np.array([truth.tip for truth in truths]),
        strain=np.array([truth.strain for truth in truths]),
        relative=np.array([truth.acceleration - truth.rigid_acceleration for truth in truths]),
        tau=nothing,
        eta=nothing,
        eta_sigma=nothing,
        fresh=np.ones(n + 1, dtype=bool),
    )
