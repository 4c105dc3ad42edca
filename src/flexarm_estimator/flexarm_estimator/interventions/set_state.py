"""Put the estimator into a known state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.filter import Belief
from flexarm_estimator.interventions.contradiction import contradiction
from flexarm_estimator.interventions.intervention import (
    LEAST_SIGMA,
    MOST,
    Intervention,
    InterventionError,
    require_numbers,
)
from flexarm_estimator.state.possible_motion import PossibleMotions

Array = NDArray[np.float64]
_SIGMAS = ("theta_sigma", "theta_dot_sigma", "eta_sigma", "eta_dot_sigma")
Numbers = tuple[float, ...]


@dataclass(frozen=True)
class SetState(Intervention):
    """A state with its one sigma; what is left empty is zero, or as uncertain as at the start.

    Attributes:
        model_id: Model that defines the modes; empty: the one in use.
        joint_names: Actuated axes in the order of ``theta``; empty: in the model's.
        theta, theta_dot: Of the axes [rad or m, rad/s or m/s], (n_theta,).
        eta, eta_dot: Of the modes [kg^0.5 m, kg^0.5 m/s], (n_eta,).
        theta_sigma, theta_dot_sigma, eta_sigma, eta_dot_sigma: One sigma of these, or one number for all.
    """

    theta: Numbers
    theta_dot: Numbers = ()
    eta: Numbers = ()
    eta_dot: Numbers = ()
    theta_sigma: Numbers = ()
    theta_dot_sigma: Numbers = ()
    eta_sigma: Numbers = ()
    eta_dot_sigma: Numbers = ()
    joint_names: tuple[str, ...] = ()
    model_id: str = ""

    def check(self, estimator: Estimator) -> None:
        """See Intervention."""
        model = estimator.model
        if self.model_id not in ("", model.model_id):
            raise InterventionError(
                f"model_id: the state belongs to model {self.model_id}, the estimator uses {model.model_id}; "
                "allowed: that one or none"
            )
        if self.joint_names and sorted(self.joint_names) != sorted(model.theta_names):
            allowed = ", ".join(model.theta_names)
            raise InterventionError(f"joint_names: {', '.join(self.joint_names)}; allowed: {allowed}")
        sizes = {"theta": model.n_theta, "eta": model.n - model.n_theta}
        require_numbers("theta", self.theta, (model.n_theta,), -MOST)
        for name in ("theta_dot", "eta", "eta_dot"):
            size = sizes[name.removesuffix("_dot")]
            require_numbers(name, getattr(self, name), (0, size), -MOST)
        for name in _SIGMAS:
            size = sizes[name.removesuffix("_sigma").removesuffix("_dot")]
            require_numbers(name, getattr(self, name), (0, 1, size), LEAST_SIGMA)
        belief = self._belief(estimator)
        parts, x = estimator.past[0], belief.x
        if refusal := parts.possible.refusal(x):
            raise InterventionError(f"theta, eta: at this state {refusal}")
        motions = PossibleMotions(estimator.specs, parts.sensors.rows, parts.layout, parts.model.omega)
        if refusal := motions.refusal(x) or contradiction(estimator, belief):
            raise InterventionError(refusal)

    def apply(self, estimator: Estimator) -> None:
        """See Intervention; torque disturbances start at zero, biases of sensors stay."""
        estimator.set_belief(self._belief(estimator))

    def describe(self) -> str:
        """See Intervention."""
        return f"state is set, theta {', '.join(f'{value:g}' for value in self.theta)}"

    def _belief(self, estimator: Estimator) -> Belief:
        parts, instants = estimator.past
        layout, before = parts.layout, instants[-1].belief
        order = [self.joint_names.index(name) for name in parts.model.theta_names if self.joint_names]
        x, sigma = np.zeros(layout.n_x), np.sqrt(parts.process.P0.diagonal())
        for name in ("theta", "eta", "theta_dot", "eta_dot"):
            place, turn = getattr(layout, name), order if name.startswith("theta") else []
            _fill(x, place, getattr(self, name), turn)
            _fill(sigma, place, getattr(self, f"{name}_sigma"), turn)
        P = np.diag(sigma**2)
        rest = slice(layout.d.stop, layout.n_x)
        x[rest], P[rest, rest] = before.x[rest], before.P[rest, rest]
        return Belief(x, P)


def _fill(target: Array, place: slice, values: Numbers, order: list[int]) -> None:
    """Write values, if there are any, in the order given; one number stands for all."""
    if values:
        column = np.broadcast_to(values, (place.stop - place.start,))
        target[place] = column[order] if order else column
