"""What a controller step answers: the torque, and everything that explains it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.guarding.messages import GuardCommand
from flexarm_controller.local_law import LocalLaw
from flexarm_controller.reference import Reference

Array = NDArray[np.float64]
Mode = Literal["inactive", "mpc", "lqr", "pd", "nmpc", "shifted_plan", "damping", "hold"]


class ControlCommand(NamedTuple):  # not a dataclass: one is made in every period
    """Torque for a period that is to come, and how it came about.

    Attributes:
        t: Instant of the state it was computed from [s].
        acts_at: Begin of the period that it is meant for [s].
        tau: Torque [N m] or force [N], (n_theta,).
        model_id: Model in use.
        mode: Rung of the ladder that made it.
        reason: Why this mode; empty in the mode that was asked for.
        solver_status: Status in the solver's own words; empty without a solver.
        iterations: Iterations of the solver [1].
        residual: Largest primal or dual residual of the scaled problem [1].
        solve_time: CPU time of the whole step [s].
        limits_active: Constraints that bind, "torque:joint.axis", "rate:...", "strain:gauge".
        plan: Torque planned for this and the following periods, (k, n_theta).
        reference: What is followed; None until there is something.
        theta: Estimate of the axes [rad] or [m], (n_theta,).
        sent: Torques that act from the state's instant until this one, oldest first, (k, n_theta).
        split: CPU time of bringing the program up to date, its solution, and the rest [s]; zeros where the
            law does not tell.
        local: Works out the law about the state in which the torque begins to act; to be asked before the
            next step. None where another rung than the law made the torque, or the law cannot tell.
    """

    t: float
    acts_at: float
    tau: Array
    model_id: str
    mode: Mode
    reason: str
    solver_status: str
    iterations: int
    residual: float
    solve_time: float
    limits_active: tuple[str, ...]
    plan: Array
    reference: Reference | None
    theta: Array
    sent: Array
    split: tuple[float, float, float] = (0.0, 0.0, 0.0)
    local: Callable[[], LocalLaw] | None = None

    def for_guard(self, sequence: int, token: int) -> GuardCommand | None:
        """Return it as the guard takes it, with its number in a session, for any model; None if inactive."""
        if self.mode == "inactive":
            return None
        return GuardCommand(self.t, sequence, token, tuple(self.tau.tolist()), acts_at=self.acts_at)

    @property
    def tracking_error(self) -> Array:
        """Reference minus estimate of the axes [rad] or [m], (n_theta,); zeros where either is unknown."""
        if self.reference is None or self.theta.size != self.tau.size:
            return np.zeros(self.tau.size)
        return np.asarray(self.reference.position(self.t) - self.theta)
