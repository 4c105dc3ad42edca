"""How fast can the arm be? The same move in less and less time, MPC on several kinds of motion.

Time is counted twice, and the longer one is taken: from the start of the motion until the tip stays in the
ball about its goal, and from when it left the ball about its start (a law with preview moves before the
motion starts). The physical limit is the time-optimal plan of the linear program, from rest to rest.
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

FACTORS = (0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1, 1.2, 1.3, 1.5, 1.75, 2.0, 2.5, 3.0, 4.0)
LEAST_TORQUE = "least torque (LP)"


@dataclass(frozen=True)
class SweepPoint:
    """One duration of one kind of motion: its scheme, and the duration of the motion [s]."""

    scheme: Scheme
    duration: float

    def arrival(self, result: CompareResult) -> float:
        """Return the time the arm took [s]; inf when it never settled."""
        return max(self.duration + result.settling, result.moving)


def sweep_points(case: Case) -> list[SweepPoint]:
    """Return MPC on the worst profile and on least torque, in multiples of the time-optimal duration.

    Empty when there is more than one move, or no way to go.
    """
    leg = case.legs[0]
    optimum = case.planned[leg.name].optimum
    if optimum is None or len(case.legs) > 1:
        return []
    durations = leg.dt * np.unique([round(factor * len(optimum.tau)) for factor in FACTORS])
    shapes: list[tuple[str, Motion, float]] = [
        (WORST, leg.given.stretched(float(T)), float(T)) for T in durations
    ]
    problem = RestToRest(leg.middle, leg.limits, leg.start, leg.goal, leg.dt)
    for T in durations[durations > optimum.duration - leg.dt / 2]:
        plan = problem.solve(round(T / leg.dt))
        if plan is not None:
            shapes.append((LEAST_TORQUE, of_plan(leg, plan), float(T)))
    return [
        SweepPoint(case.scheme(MPC, f"{name}, {T:.3f} s", {leg.name: motion}), T)
        for name, motion, T in shapes
    ]


def shortest(points: Sequence[SweepPoint], results: Sequence[CompareResult]) -> tuple[SweepPoint, float]:
    """Return the point that arrives first, and when [s]."""
    arrivals = [point.arrival(result) for point, result in zip(points, results, strict=True)]
    best = int(np.argmin(arrivals))
    return points[best], arrivals[best]
