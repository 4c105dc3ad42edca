"""What a run is worth: the truth at every tick, and the figures of every move.

Residual: what is left of the vibration after a move (the signal of the moves file, low-passed, RMS over the
window). Settling: from the end of the motion until the tip stays in a ball about the point where the real
arm rests with its axes at the goal. Moves of a series are put together: RMS of the residuals, the latest
settling, the largest torque and strain.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.compare_laws.schemes import SERVO
from flexarm_bringup.residual import rms, sample_rate, settling_time
from flexarm_bringup.sim.rig import Truth
from flexarm_bringup.tasks.course import Leg
from flexarm_bringup.tasks.task import Task
from flexarm_bringup.tip_vibration import LAST_PART, tip_acceleration, without_fast

Array = NDArray[np.float64]
STAY = 0.05  # s in the ball about the start, from which on the tip counts as being there


@dataclass(frozen=True)
class LegFigures:
    """What one move is worth.

    Attributes:
        residual: RMS of the signal in the window after it [m/s^2].
        settling: From its end until the tip stays in the ball about its goal [s]; inf for never.
        moving: From when the tip left the ball about its start until then [s]; None when it was not in it
            before the move.
        rest_error: Distance from its goal of where the tip is on average in the last part of the window [m].
        peak_torque: Largest torque over the described limit [1].
        peak_strain: Largest strain at a gauge [1].
    """

    residual: float
    settling: float
    moving: float | None
    rest_error: float
    peak_torque: float
    peak_strain: float


@dataclass(frozen=True)
class CompareResult:
    """A row under one condition.

    Attributes:
        preset: Preset of the description.
        frequency_error: Real over described frequencies, minus 1.
        motion, law: Of the scheme.
        is_scarce: Whether its torque was scarce.
        legs: Figures of every move; empty when it could not be run.
        stopped: Why it was refused or stopped, or that it had no state; empty when all went well.
        t: Times since the end of the first move [s], (k,).
        off: Distance of the tip from its goal then [m], (k,).
    """

    preset: str
    frequency_error: float
    motion: str
    law: str
    is_scarce: bool
    legs: tuple[LegFigures, ...]
    stopped: str
    t: Array
    off: Array

    @property
    def residual(self) -> float:
        """Residual of all moves together, RMS [m/s^2]; inf when they were not done."""
        return float(np.sqrt(np.mean([leg.residual**2 for leg in self.legs]))) if self.has_ended else np.inf

    @property
    def has_ended(self) -> bool:
        """Whether the moves were done: a run that was stopped is quiet, which says nothing of its law."""
        return bool(self.legs) and not self.stopped

    @property
    def settling(self) -> float:
        """Latest settling after the end of a move [s]; inf for never."""
        return max(leg.settling for leg in self.legs) if self.has_ended else np.inf

    @property
    def moving(self) -> float | None:
        """Longest time from leaving a start to staying at a goal [s]; inf for never, None for not known."""
        known = [leg.moving for leg in self.legs if leg.moving is not None]
        if not self.has_ended:
            return np.inf
        return max(known) if len(known) == len(self.legs) else None

    @property
    def rest_error(self) -> float:
        """Largest distance from a goal at the end of its window [m]."""
        return max((leg.rest_error for leg in self.legs), default=np.nan)

    @property
    def peak_torque(self) -> float | None:
        """Largest torque over the described limit [1]; None on the ideal servo."""
        return None if self.law == SERVO else max((leg.peak_torque for leg in self.legs), default=np.nan)

    @property
    def peak_strain(self) -> float:
        """Largest strain at a gauge [1]."""
        return max((leg.peak_strain for leg in self.legs), default=np.nan)


@dataclass(frozen=True)
class TrueRecord:
    """What really happened at every tick.

    Attributes:
        t: Time [s], (k,).
        tip: Position of the tip [m], (k, 3).
        relative: At the accelerometers, less what they would feel on a rigid arm [m/s^2], (k, c).
        load: Torque from then on over its described limit [1], (k, n_theta).
        strain: At the gauges [1], (k, n_gauges).
    """

    t: Array
    tip: Array
    relative: Array
    load: Array
    strain: Array


def true_row(t: float, truth: Truth, tau: Array) -> dict[str, Array]:
    """Return one tick: time [s], truth, torque from now on (n_theta,)."""
    relative = truth.acceleration - truth.rigid_acceleration
    return {"t": np.array(t), "tip": truth.tip[:3], "relative": relative, "tau": tau, "strain": truth.strain}


def stack_rows(rows: Sequence[Mapping[str, Array]], limits: Array) -> TrueRecord:
    """Return the record of rows; ``limits`` of the torque are the described ones, (n_theta,)."""
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    load = columns["tau"] / limits
    return TrueRecord(columns["t"], columns["tip"], columns["relative"], load, columns["strain"])


def judge_leg(record: TrueRecord, leg: Leg, task: Task, start: Array, goal: Array) -> LegFigures:
    """Return what a move is worth.

    Args:
        record: Of the whole run.
        leg: The move in time.
        task: How it is judged.
        start: Where the tip rests before it [m], (3,).
        goal: Where it shall rest after it [m], (3,).
    """
    watch, t = task.watch, record.t
    slack = 0.5 / sample_rate(t)
    slot = (t >= leg.start - task.lead / 2) & (t <= leg.end + watch.end + slack)
    inside = slot & (t >= leg.end + watch.begin - slack)
    last = max(int(LAST_PART * inside.sum()), 1)
    off = np.linalg.norm(record.tip - goal, axis=1)
    settling = settling_time(t[slot], off[slot], leg.end, watch.tolerance)
    begun = (t >= leg.start - task.lead) & (t <= leg.end + slack)
    left = _leaving(t[begun], np.linalg.norm(record.tip[begun] - start, axis=1), watch.tolerance)
    return LegFigures(
        rms(np.linalg.norm(vibration(record, task)[inside], axis=1)),
        settling,
        None if left is None else leg.end + settling - left,
        float(np.linalg.norm(record.tip[inside][-last:].mean(axis=0) - goal)),
        float(abs(record.load[slot]).max()),
        float(abs(record.strain[slot]).max(initial=0.0)),
    )


def _leaving(t: Array, away: Array, tolerance: float) -> float | None:
    """Return the first tick out of the ball after the last stay in it [s]; None when it never stayed there.

    A tip that swings through the ball does not stay: it winds up for the move, or still rings from another.
    A lap ends where it began, so that only what is before the farthest tick counts.

    Args:
        t: Until the end of the motion [s], (k,).
        away: Distance of the tip from its start [m], (k,).
        tolerance: Radius of the ball [m].
    """
    is_in = away[: int(np.argmax(away)) + 1] <= tolerance
    edges = np.diff(is_in, prepend=False, append=False)
    entered, left = np.flatnonzero(edges).reshape(-1, 2).T  # first ticks inside, first ticks outside again
    stays = left[(left - entered) * (t[1] - t[0]) >= STAY]
    return float(t[min(stays[-1], t.size - 1)]) if stays.size else None


def vibration(record: TrueRecord, task: Task) -> Array:
    """Return the low-passed signal that is judged, without delay [m/s^2], (k, c)."""
    rate_hz = sample_rate(record.t)
    if task.compare.signal == "tip":
        return tip_acceleration(record.tip, rate_hz, task.watch.cutoff_hz)
    return without_fast(record.relative, rate_hz, task.watch.cutoff_hz)
