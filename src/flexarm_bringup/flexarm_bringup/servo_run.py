"""Open-loop runs on an ideal servo: the axis does what it is told, the arm rings as it will."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.demo_run.motions import Move, sample_moves
from flexarm_bringup.record import RunRecord
from flexarm_bringup.sim.rig import Rig, Truth

Array = NDArray[np.float64]


def run_servo(rig: Rig, moves: Sequence[Move]) -> RunRecord:
    """Move the axis as prescribed and return what happened.

    Args:
        rig: A rig at tick 0.
        moves: The series.
    """
    n = round(moves[-1].slot_end / rig.dt)
    times = np.asarray(np.arange(n + 1) * rig.dt, dtype=np.float64)
    _, velocity, _ = sample_moves(moves, times)
    truths = list(lead(rig, velocity[:, None]))
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


def lead(rig: Rig, velocity: Array) -> Iterator[Truth]:
    """Move the axes as prescribed and yield what really happens at every tick.

    The acceleration of a period is the change of the prescribed velocity, so the velocity is exact at
    every tick.

    Args:
        rig: A rig at tick 0.
        velocity: Of the axes at every tick [rad/s or m/s], (k, n_theta).
    """
    yield rig.truth()
    for acceleration in np.diff(velocity, axis=0) / rig.dt:
        rig.servo(acceleration)
        yield rig.truth()
