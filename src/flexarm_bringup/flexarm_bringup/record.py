"""What happened in a run, tick by tick, and what its moves are worth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.demo_run.motions import Move
from flexarm_bringup.residual import residual_rms, settling_time

Array = NDArray[np.float64]


@dataclass(frozen=True)
class RunRecord:
    """Truth, torque and estimate at every tick; (k, ...) each.

    Attributes:
        t: Time [s], (k,).
        theta: True position of the actuated axes [rad], (k, n_theta).
        tip: True position and rotation vector of the tip [m, rad], (k, 6).
        strain: True strain at the gauges [1], (k, n_gauges).
        relative: True acceleration minus a rigid arm's at the accelerometers [m/s^2], (k, n_acc).
        tau: Torque from the tick on [N m], (k, n_theta).
        eta: Estimated modes, NaN where there is no estimate, (k, n_eta).
        eta_sigma: Their standard deviation, (k, n_eta).
        fresh: The torque came from a fresh command, (k,).
    """

    t: Array
    theta: Array
    tip: Array
    strain: Array
    relative: Array
    tau: Array
    eta: Array
    eta_sigma: Array
    fresh: NDArray[np.bool_]

    def between(self, start: float, end: float) -> RunRecord:
        """Return the ticks of [start, end]."""
        inside = (self.t >= start - 1e-9) & (self.t <= end + 1e-9)
        return RunRecord(*(getattr(self, field.name)[inside] for field in fields(self)))


def stack(ticks: Sequence[Mapping[str, Array]]) -> RunRecord:
    """Return the record of rows that each hold one tick under the names of the record's fields."""
    return RunRecord(
        **{field.name: np.array([tick[field.name] for tick in ticks]) for field in fields(RunRecord)}
    )


@dataclass(frozen=True)
class Figures:
    """What a move is worth.

    Attributes:
        residual: RMS of the relative tip acceleration after it, 20 Hz [m/s^2].
        settling: Time from its end until the tip stays within 0.5 mm of its goal [s].
        peak_torque: Largest torque in its slot [N m].
        peak_strain: Largest strain in its slot [1].
    """

    residual: float
    settling: float
    peak_torque: float
    peak_strain: float


def judge(record: RunRecord, move: Move, reach: float) -> Figures:
    """Return the figures of a move.

    Args:
        record: Of the whole run.
        move: The move.
        reach: Distance of the tip from the axis [m].
    """
    slot = record.between(move.start - 0.2, move.watch_end)
    goal = reach * np.array([np.cos(move.goal), np.sin(move.goal)])
    error = np.linalg.norm(slot.tip[:, :2] - goal, axis=1)
    return Figures(
        residual=residual_rms(slot.t, slot.relative[:, 0], move.end),
        settling=settling_time(slot.t, error, move.end),
        peak_torque=float(abs(slot.tau).max(initial=0.0)),
        peak_strain=float(abs(slot.strain).max()),
    )
