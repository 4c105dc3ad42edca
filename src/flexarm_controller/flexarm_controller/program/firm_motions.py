"""Motions that bring the modes to rest by themselves, and the weights that follow them exactly.

With the axes locked onto a motion each mode is an oscillator that its acceleration pushes. With
``p = -zeta omega + i omega_d`` its velocity amplitude after every period is::

    a_{k+1} = e^{p dt} a_k + M_et (theta'_{k+1} - theta'_k)

and what is left at the end, over the largest on the way, tells whether the motion was made for this arm. Soft
axes would only blur such a motion: they set out early and arrive late. A motion that takes longer than a few
periods of the arm gains nothing by it, and would pay with the sensors' noise.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.reference import Reference
from flexarm_controller.settings import MpcConfig
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.settings.parameters import ParameterError

Array = NDArray[np.float64]
RINGS = 0.02  # of the largest amplitude on the way; ten times what rounding to periods leaves
MOVES = 1e-6  # rad/s or m/s; slower is rest


def firm(config: MpcConfig) -> MpcConfig:
    """Return the settings with axes held ``firmness`` times as firmly, modes and torque that much freer.

    Raises:
        ParameterError: Such a weight is beyond its range.
    """
    f = config.firmness
    try:
        return replace(
            config,
            position_error=config.position_error / f,
            velocity_error=config.velocity_error / f,
            modal_energy=config.modal_energy * f,
            input_acceleration=config.input_acceleration * f**2,
            input_jerk=config.input_jerk * f**2,
        )
    except ParameterError as error:
        raise ParameterError(f"firmness: {f:g} times as firm, which firm_time asks for, {error}") from None


def firm_motions(
    reference: Reference,
    model: ReducedModel,
    longest: float,
    dt: float,
    window: tuple[float, float] = (-math.inf, math.inf),
) -> Array:
    """Return begin and end [s] of the motions that are to be followed exactly, (k, 2).

    Args:
        reference: Of the axes; motions are what is between two rests.
        model: Whose modes must not ring afterwards.
        longest: Such a motion may take [s].
        dt: Control period [s].
        window: Only those that lie within it as a whole [s]; a reference may take an hour.
    """
    count = round((reference.t[-1] - reference.t[0]) / dt) + 2
    first, last = ((at - float(reference.t[0])) / dt for at in window)
    times = reference.t[0] + dt * np.arange(np.ceil(max(first, -1.0)), np.floor(min(last, count - 1.0)) + 1.0)
    if not times.size:
        return np.zeros((0, 2))
    _, velocity, _ = reference.sample(times)
    moves = np.concatenate([[False], (abs(velocity) > MOVES).any(axis=1), [False]])
    begins, ends = np.flatnonzero(np.diff(moves.astype(int)).reshape(-1)).reshape(-1, 2).T
    found = [
        (times[begin - 1], times[end])
        for begin, end in zip(begins.tolist(), ends.tolist(), strict=True)
        if begin > 0  # else it began before
        and end < times.size  # else it ends later
        and (end - begin) * dt <= longest
        and _ringing(model, velocity[begin - 1 : end + 1], dt) <= RINGS
    ]
    return np.array(found).reshape(-1, 2)


def _ringing(model: ReducedModel, velocity: Array, dt: float) -> float:
    """Return the amplitude of all modes at the end over the largest on the way [1]."""
    m = model.n_theta
    slowest = model.omega * (np.sqrt(model.zeta**2 - 1.0 + 0j) - model.zeta)  # pole of a mode, (n_eta,)
    turn = np.exp(slowest * dt)
    pushes = np.diff(velocity, axis=0) @ model.M[:m, m:]  # (k, n_eta)
    amplitude, largest = np.zeros(model.n_eta, complex), float(np.finfo(float).tiny)
    for push in pushes:
        amplitude = turn * amplitude + push
        largest = max(largest, float(np.linalg.norm(amplitude)))
    return float(np.linalg.norm(amplitude)) / largest
