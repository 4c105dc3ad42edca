"""How fast can the arm be? The same move in less and less time, MPC on several kinds of motion.

MPC follows the worst profile and the motion of least torque that leaves no mode ringing, with the settings it
always has.

The time that is taken is the longest of three: the motion's own, from its start until the tip stays in the
ball about its goal, and until then from when the tip left the ball about its start (a law with preview moves
before the motion starts). The physical limit is the linear program's time-optimal plan, from rest to rest.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from flexarm_bringup.compare_laws.judged import CompareResult
from flexarm_bringup.compare_laws.least_torque import least_torque
from flexarm_bringup.compare_laws.open_loop_motions import LEAST_TORQUE
from flexarm_bringup.compare_laws.schemes import MPC, WORST, Case, Scheme
from flexarm_controller.open_loop.axis_motion import Motion

FACTORS = (0.6, 0.8, 1.0, 1.05, 1.1, 1.2, 1.3, 1.5, 1.75, 2.0, 2.5, 3.0, 4.0)  # of the time-optimal duration
SWEEP_ERRORS = (0.0, -0.10, 0.10)  # of all frequencies


@dataclass(frozen=True)
class SweepPoint:
    """One duration of one kind of motion.

    Attributes:
        kind: Of the motion.
        scheme: What is run.
        duration: Of the motion [s].
        is_within: Whether the motion keeps the limits of the arm: MPC is not to be stopped on it.
    """

    kind: str
    scheme: Scheme
    duration: float
    is_within: bool = False

    def arrival(self, result: CompareResult) -> float:
        """Return the time the arm took [s]; inf when it never settled, or nobody can tell when it left."""
        moving = np.inf if result.moving is None else result.moving
        return max(self.duration, self.duration + result.settling, moving)


@dataclass(frozen=True)
class Sweep:
    """What is run, and what is not.

    Attributes:
        points: Everything that is run.
        left_out: Why a motion is missing, by its name.
    """

    points: Sequence[SweepPoint] = ()
    left_out: Mapping[str, str] = field(default_factory=dict)

    def by_error(self, results: Sequence[CompareResult]) -> list[Sequence[CompareResult]]:
        """Return the results of all points, one list per frequency error."""
        n = len(self.points)
        return [results[i * n : (i + 1) * n] for i in range(len(SWEEP_ERRORS))]


def plan_sweep(case: Case) -> Sweep:
    """Return MPC on the worst profile and on least torque, in multiples of the time-optimal duration.

    Empty when there is more than one move, or no way to go.
    """
    leg = case.legs[0]
    optimum = case.planned[leg.name].optimum
    if optimum is None or len(case.legs) > 1:
        return Sweep()
    fewest = len(optimum.tau)
    counts = sorted({round(factor * fewest) for factor in FACTORS})
    points, left_out = [], {}
    for periods in counts:
        motion = leg.given.stretched(periods * leg.dt)
        points.append(_point(case, WORST, motion, leg.is_allowed(motion)))
    for periods in counts:
        if periods < fewest:  # there is none by definition
            continue
        try:
            points.append(_point(case, LEAST_TORQUE, least_torque(leg, periods), True))
        except ValueError as error:
            left_out[_name(LEAST_TORQUE, periods * leg.dt)] = str(error)
    return Sweep(tuple(points), left_out)


def _point(case: Case, kind: str, motion: Motion, is_within: bool) -> SweepPoint:
    scheme = case.scheme(MPC, _name(kind, motion.duration), {case.legs[0].name: motion})
    return SweepPoint(kind, scheme, motion.duration, is_within)


def _name(kind: str, duration: float) -> str:
    return f"{kind}, {duration:.3f} s"


def shortest(points: Sequence[SweepPoint], results: Sequence[CompareResult]) -> tuple[SweepPoint, float]:
    """Return the point that arrives first, and when [s]."""
    arrivals = [point.arrival(result) for point, result in zip(points, results, strict=True)]  # as described
    best = int(np.argmin(arrivals))
    return points[best], arrivals[best]
