"""How fast can the arm be? The same move in less and less time, MPC on several kinds of motion.

MPC follows the worst profile and the motion of least torque that leaves no mode ringing, with the settings it
always has.

The time that is taken is the longest of three: the motion's own, from its start until the tip stays in the
ball about its goal, and until then from when the tip left the ball about its start (a law with preview moves
before the motion starts). The physical limit is the linear program's time-optimal plan, from rest to rest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexarm_bringup.compare_laws.judged import CompareResult
from flexarm_bringup.compare_laws.open_loop_motions import of_plan
from flexarm_bringup.compare_laws.schemes import MPC, WORST, Case, Scheme
from flexarm_controller.open_loop.axis_motion import Motion
from flexarm_controller.open_loop.rest_to_rest import RestToRest

FACTORS = (0.6, 0.8, 1.0, 1.05, 1.1, 1.2, 1.3, 1.5, 1.75, 2.0, 2.5, 3.0, 4.0)  # of the time-optimal duration
SWEEP_ERRORS = (0.0, -0.10, 0.10)  # of all frequencies
LEAST_TORQUE = "least torque (LP)"


@dataclass(frozen=True)
class SweepPoint:
    """One duration of one kind of motion.

    Attributes:
        kind: Of the motion.
        scheme: What is run.
        duration: Of the motion [s].
    """

    kind: str
    scheme: Scheme
    duration: float

    def arrival(self, result: CompareResult) -> float:
        """Return the time the arm took [s]; inf when it never settled."""
        return max(self.duration, self.duration + result.settling, result.moving)


def sweep_points(case: Case) -> list[SweepPoint]:
    """Return MPC on the worst profile and on least torque, in multiples of the time-optimal duration.

    Empty when there is more than one move, or no way to go.
    """
    leg = case.legs[0]
    optimum = case.planned[leg.name].optimum
    if optimum is None or len(case.legs) > 1:
        return []
    durations = leg.dt * np.unique([round(factor * len(optimum.tau)) for factor in FACTORS])
    kinds: list[tuple[str, Motion, float]] = [
        (WORST, leg.given.stretched(float(T)), float(T)) for T in durations
    ]
    problem = RestToRest(leg.middle, leg.limits, leg.start, leg.goal, leg.dt)
    plans = [problem.solve(round(T / leg.dt)) for T in durations]
    least = [of_plan(leg, plan) for plan in plans if plan is not None]
    kinds += [(LEAST_TORQUE, motion, motion.duration) for motion in least]
    return [_point(case, *kind) for kind in kinds]


def _point(case: Case, kind: str, motion: Motion, T: float) -> SweepPoint:
    return SweepPoint(kind, case.scheme(MPC, f"{kind}, {T:.3f} s", {case.legs[0].name: motion}), T)


def by_error(points: Sequence[SweepPoint], results: Sequence[CompareResult]) -> list[list[CompareResult]]:
    """Return the results of a sweep, one list per frequency error."""
    n = len(points)
    return [list(results[i * n : (i + 1) * n]) for i in range(len(SWEEP_ERRORS))]


def shortest(points: Sequence[SweepPoint], results: Sequence[CompareResult]) -> tuple[SweepPoint, float]:
    """Return the point that arrives first, and when [s]."""
    arrivals = [point.arrival(result) for point, result in zip(points, results, strict=True)]  # as described
    best = int(np.argmin(arrivals))
    return points[best], arrivals[best]
