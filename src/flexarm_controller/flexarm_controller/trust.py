"""Whether an estimate is sure enough for the law to take over, after a start or an interruption.

Interrupted is an estimate that cannot be used, and one that began after the last one that came.
What counts is ``3 sigma`` of every coordinate of the state, in deviations that cost 1 (the weights of the
predictive controller): an estimator that has just begun anew vouches for its state long before it knows the
modes. Once the law has taken over, a growing sigma does not stop it: that is the estimator's own judgement.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.program.cost import build_cost
from flexarm_controller.settings import MpcConfig
from flexarm_controller.state import ArmState
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
ROUNDED = 1e-6  # s; of instants


class Trust:
    """Opens once the estimate is sure, closes when it was interrupted."""

    def __init__(self, limit: float) -> None:
        """Open at ``3 sigma <= limit`` in deviations that cost 1."""
        self._limit, self._is_open, self._t = limit, False, math.inf

    def follow(self, t: float, age: float) -> None:
        """Close if the estimate for ``t``, which began ``age`` before [s], began after the last one came."""
        if age < abs(t - self._t) - ROUNDED:
            self.close()
        self._t = t

    def judge(self, state: ArmState, model_id: str, former_id: str, scale: Array) -> str:
        """Return why a state cannot be used; empty when it can.

        Args:
            state: What has come.
            model_id: Model in use.
            former_id: The one before.
            scale: See ``fault``.
        """
        self.follow(state.t, state.age)
        fault = _unusable(state, model_id, former_id)
        if fault:
            self.close()
            return fault
        return self.fault(state.sigma, scale)

    def close(self) -> None:
        """Ask for a sure estimate again."""
        self._is_open = False

    def fault(self, sigma: Array, scale: Array) -> str:
        """Return why the estimate is not sure enough; empty when it is, and when nobody tells sigma.

        Args:
            sigma: Of x = [theta; eta; theta'; eta'], (2 n,), or (0,).
            scale: Cost of a deviation, its square root, (2 n,).
        """
        if self._is_open or not sigma.size:
            return ""
        largest = float(3.0 * (sigma * scale).max())
        self._is_open = largest <= self._limit
        if self._is_open:
            return ""
        return f"estimator: 3 sigma of the state is {largest:.3g} of at most {self._limit:.3g}"


def _unusable(state: ArmState, model_id: str, former_id: str) -> str:
    if state.model_id != model_id:
        is_behind = state.model_id == former_id
        stale = "the estimator still uses the one before" if is_behind else "the controller lacks it"
        return f"state belongs to model {state.model_id}, the controller has {model_id}: {stale}"
    if not state.is_finite:
        return "state is not finite"
    return "" if state.usable else f"estimator: {state.reason or 'state is not usable'}"


def deviation_scale(model: ReducedModel, config: MpcConfig, dt: float) -> Array:
    """Return the square root of what a deviation of each coordinate of x costs, (2 n,)."""
    return np.asarray(np.sqrt(np.diag(build_cost(model, config, dt).Q)))
