"""The soonest rest of axes that move: all brake in proportion to their velocities, and rest together.

A box for whatever motion there may be (`axis_limits`) must bear all axes braking at once in any directions:
where they are coupled that is little, and the weak axes go on for long. A stop is one motion. Its box is::

    |theta''| <= x w      |theta'''| <= y w      w = |theta'| + ramp |theta''|  when it begins

so that axes on a straight line stay there; y is what the torque rates allow, x the largest with which no
motor and no gauge is asked for more than it has. The ramp is how long the torque for that is raised.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.motion.axis_limits import AxisLimits
from flexarm_controller.motion.demand import Demand, WayDemand
from flexarm_controller.motion.excess import find_excess
from flexarm_controller.motion.point_to_point import MotionState, stop
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.stretch import grid
from flexarm_controller.reference import Reference

Array = NDArray[np.float64]
MOST = 2.0  # times what inertia alone may ask: braking may first take back a torque as large
LEAST = 2.0**-4  # of the same; what leaves less than that stands almost beyond what may be used
STEP = 1.5  # from box to box; from above, for a soft stop goes far, and may ask more than a hard one
CLOSE = 1.02  # boxes that differ by less are alike
TRIES = 20  # boxes; 15 reach the least, the others have a lower jerk
NOTHING = 1e-9  # of what there is, or of the fastest axis


class Halt:
    """Stops of one arm within what it may be asked, or is asked already when they begin."""

    def __init__(
        self, demand: Demand | WayDemand, effort_rate: Array, limits: Limits, names: Sequence[str]
    ) -> None:
        """Keep within ``demand.most``, the torque rates and ``limits``.

        Args:
            demand: Around where the axes are.
            effort_rate: That stops may have [N m/s, N/s], (n_theta,).
            limits: Of the arm.
            names: Of the axes, "joint.axis".
        """
        self._demand, self._rate, self._limits, self._names = demand, effort_rate, limits, names

    def can_hold(self, theta: Array) -> bool:
        """Tell whether standing still at ``theta`` (n_theta,) asks less than there is."""
        return bool((abs(self._demand.standing(theta[None])) < self._demand.most).all())

    def rest_about(self, start: MotionState) -> Array:
        """Return where the axes come to rest if inertia alone is asked what there is, (n_theta,)."""
        x, _ = self._alone(start, start.theta_dot)
        return start.theta + start.theta_dot / (2.0 * x)

    def soonest(self, start: MotionState, t: float) -> Reference:
        """Return the stop that begins at ``t`` [s].

        Raises:
            MotionError: It leaves the range of an axis, or the torques and their rates allow none.
        """
        x, y = self._alone(start, start.theta_dot)
        w = abs(start.theta_dot) + x / y * abs(start.theta_ddot)
        w = np.maximum(w, NOTHING * w.max())
        x, y = self._alone(start, np.copysign(w, start.theta_dot))
        low, high, best = LEAST * x, MOST * x, None
        for _ in range(TRIES):
            x = max(high / STEP, float(np.sqrt(low * high)))
            halt = stop(start, AxisLimits(w, x * w, y * w), t)
            share, hurry = self._shares(halt)
            if hurry > 1.0:
                y /= CLOSE * hurry
            elif share > 1.0:
                high = x
            else:
                low, best = x, halt
            if high <= CLOSE * low:
                break
        if best is None:
            raise MotionError("torques and their rates allow no stop")
        if excess := find_excess(best, self._limits, self._names):
            raise MotionError(str(excess))
        return best

    def _alone(self, start: MotionState, theta_ddot: Array) -> tuple[float, float]:
        """Return the factors with which an acceleration's inertia asks all torque, and all its rate [1]."""
        theta, still = start.theta[None], np.zeros((1, start.theta.size))
        push = self._demand.asked(theta, still, theta_ddot[None]) - self._demand.standing(theta)
        push = np.maximum(abs(push[0]), NOTHING * self._demand.most)
        return float((self._demand.most / push).min()), float((self._rate / push[: self._rate.size]).min())

    def _shares(self, halt: Reference) -> tuple[float, float]:
        """Return the largest share of torque or strain that a stop asks, and of a torque rate [1]."""
        times, n = grid(halt), self._rate.size
        asked = self._demand.asked(*halt.sample(times))
        most = np.maximum(self._demand.most, abs(asked[0]))
        rates = abs(np.diff(asked[:, :n], axis=0)) / np.diff(times)[:, None]
        return float((abs(asked) / most).max()), float((rates / self._rate).max(initial=0.0))
