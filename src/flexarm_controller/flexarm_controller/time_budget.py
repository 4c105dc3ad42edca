"""The time a law may take, kept by the wall clock.

A law that took longer than its budget rests until, on average, it is within it again: after a step of ``w``
seconds it is asked again ``ceil(w / budget)`` periods later. Meanwhile lower rungs of the ladder answer at
once, so a slow solver cannot make every command late. Without a wall clock (lockstep, replay, simulation)
nothing is measured and nothing depends on how busy the machine is.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from flexarm_controller.mpc import Plan
from flexarm_controller.solvers.qp import QpResult

SAME_PERIOD = 0.5  # periods by which stamps may be early


@dataclass(frozen=True)
class Clocks:
    """Clocks of a controller.

    Attributes:
        cpu: CPU time of this thread [s], for ``solve_time``.
        wall: Wall time [s], for the time budget; None where results must not depend on it.
    """

    cpu: Callable[[], float] = time.thread_time
    wall: Callable[[], float] | None = None


class TimeBudget:
    """Lets a law be asked when it has time, and measures how long it takes.

    Attributes:
        overruns: Answers that took longer than the budget [1].
    """

    def __init__(self, budget: float, period: float, wall: Callable[[], float] | None) -> None:
        """Allow ``budget`` of every ``period`` [s]; 0 for no limit."""
        self._budget, self._period = budget, period
        self._wall = wall if budget > 0.0 else None
        self._asked = self._resume = -math.inf
        self._took = 0.0
        self.overruns = 0

    def ask(self, t: float, law: Callable[[], Plan]) -> tuple[Plan, str]:
        """Return the plan for the state of ``t`` [s], and why it cannot be used; empty when it can."""
        if self._asked <= t < self._resume - SAME_PERIOD * self._period:  # not when stamps went back
            return NO_PLAN, f"the law rests: it took {1e3 * self._took:.3g} ms of {1e3 * self._budget:.3g} ms"
        if self._wall is None:
            return _attempt(law)
        started = self._wall()
        answer = _attempt(law)
        self._took = self._wall() - started
        periods = math.ceil(self._took / self._budget)
        self.overruns += periods > 1
        self._asked, self._resume = t, t + periods * self._period if periods > 1 else -math.inf
        return answer


NO_PLAN = Plan(np.zeros((0, 0)), QpResult(np.zeros(0), "", 0, 0.0, False), ())


def _attempt(law: Callable[[], Plan]) -> tuple[Plan, str]:
    """Return the plan of a law and why it cannot be used; whatever it raises is a reason."""
    try:
        plan = law()
    except Exception as error:  # solvers' own errors have no other common base, and the next rung is waiting
        return NO_PLAN, f"law raised {type(error).__name__}: {' '.join(str(error).split())[:80]}"
    if plan.is_empty or not plan.result.solved:
        return plan, f"solver: {plan.result.status}"
    torques = plan.torques.ravel()
    return plan, "" if math.isfinite(torques.dot(torques)) else "law: torque is not finite"
