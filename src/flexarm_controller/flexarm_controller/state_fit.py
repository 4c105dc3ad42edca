"""Whether a state fits the model: as many axes and modes as it has, at an instant that is a number."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.state import ArmState
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]


def fitted(state: ArmState, model: ReducedModel) -> ArmState:
    """Return the state itself where it fits the model, else one that fits, not usable, with the reason.

    Of one that does not fit the axes are kept as far as they do: damping needs their velocity. All else of
    it is zero, and an instant that is no finite number is NaN.
    """
    axes, modes = (model.n_theta,), (model.n_eta,)
    if not (state.theta.shape == state.theta_dot.shape == state.d.shape == axes):
        return _unfit(state, model)
    if not (state.eta.shape == state.eta_dot.shape == modes and _has_possible_rest(state, modes)):
        return _unfit(state, model)
    if math.isfinite(state.t):
        return state
    return replace(state, t=math.nan, usable=False, reason=f"state is of the instant {state.t}")


def _has_possible_rest(state: ArmState, modes: tuple[int]) -> bool:
    """Return whether what a state may leave out is of a possible length; empty it mostly is."""
    sigma, sag, stiffness = state.sigma.shape, state.sag.shape, state.stiffness.shape
    has_sigma = sigma == (0,) or sigma == (2 * (state.theta.size + modes[0]),)
    return has_sigma and len(sag) == len(stiffness) == 1 and sag <= modes and stiffness <= modes


def _unfit(state: ArmState, model: ReducedModel) -> ArmState:
    axes, modes = np.zeros(model.n_theta), np.zeros(model.n_eta)
    theta, theta_dot = (part if part.shape == axes.shape else axes for part in (state.theta, state.theta_dot))
    t = state.t if math.isfinite(state.t) else math.nan
    reason = _misfit(state, model.n_theta, model.n_eta)
    return ArmState(t, state.model_id, theta, modes, theta_dot, modes, axes, False, reason)


def _misfit(state: ArmState, n_theta: int, n_eta: int) -> str:
    """Return the first part of a state that does not fit, and what would."""
    n_x = 2 * (n_theta + n_eta)
    wanted = {"theta": n_theta, "eta": n_eta, "theta_dot": n_theta, "eta_dot": n_eta, "d": n_theta}
    for name, size in wanted.items():
        if (given := getattr(state, name).shape) != (size,):
            return f"state has {_spoken(given)} {name}, the model {size}"
    if (given := state.sigma.shape) not in ((0,), (n_x,)):
        return f"state has {_spoken(given)} sigma, the model {n_x}"
    name = "stiffness" if len(state.sag.shape) == 1 and state.sag.size <= n_eta else "sag"
    return f"state has {_spoken(getattr(state, name).shape)} {name}, the model at most {n_eta}"


def _spoken(shape: tuple[int, ...]) -> str:
    return str(shape[0]) if len(shape) == 1 else f"an array of shape {shape} as"
