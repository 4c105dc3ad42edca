"""A piece of the recent past, and the joint steps through it."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief
from flexarm_estimator.joint_step import JointStep
from flexarm_estimator.parts import Parts

Array = NDArray[np.float64]
_CACHE_SIZE = 200  # joint steps of a model
_MODELS = 8  # whose steps are kept: more than a window has, for what is kept of a model takes 0.4 MB
_LEARNED = 0.01  # parameters that differ by less are one


@dataclass(frozen=True)
class Window:
    """The recent past.

    Attributes:
        t: Stamps [s], (k,).
        u: Inputs of the filter held until then, (k, n_inputs).
        y: What the channels said, NaN where nothing, (k, m).
        parts: Model in use at each.
        theta: Axes at the start, a guess [rad] or [m], (n_theta,).
        learned: Parameters of the model as learned, (n_p,).
    """

    t: Array
    u: Array
    y: Array
    parts: list[Parts]
    theta: Array
    learned: tuple[float, ...] = ()

    def halves(self, values: Array) -> Array:
        """Return the sums over the first and the second half of values of all instants, (2, ...)."""
        middle = (len(self.t) + 1) // 2
        return np.array([values[:middle].sum(axis=0), values[middle:].sum(axis=0)])


class Matrices(ctypes.Structure):
    """A step as machine code reads it ("struct matrices" of consistency_steps.c)."""

    _fields_ = tuple((name, ctypes.c_void_p) for name in ("T", "V", "noise"))


class WindowStep(NamedTuple):
    """The matrices of a joint step without what only one sample needs.

    Attributes:
        m: Number of rows.
        T: (m + n_x, n_x).
        T_transposed: (n_x, m + n_x).
        V: (m + n_x, n_inputs).
        noise: (m + n_x, m + n_x).
        floor: Variance of every row with the force noise it feels, (m,).
        layout: The same for machine code.
    """

    m: int
    T: Array
    T_transposed: Array
    V: Array
    noise: Array
    floor: Array
    layout: Matrices


class StepMaker:
    """Joint steps of all rows, kept per model and period."""

    def __init__(self, resolution: float) -> None:
        """Take periods as equal that differ by less than ``resolution`` [s]."""
        self._resolution = resolution
        self._steps: dict[int, tuple[Parts, dict[tuple[int, tuple[int, ...]], WindowStep]]] = {}

    def step(self, parts: Parts, dt: float, learned: tuple[float, ...] = ()) -> WindowStep:
        """Return the step of a model, with what has been learned of it, over ``dt`` [s]."""
        count = max(1, round(dt / self._resolution))
        key = count, tuple([round(p / _LEARNED) for p in learned])
        if id(parts) not in self._steps:
            while len(self._steps) >= _MODELS:
                del self._steps[next(iter(self._steps))]
            self._steps[id(parts)] = parts, {}
        steps = self._steps[id(parts)][1]
        if key not in steps:
            if len(steps) >= _CACHE_SIZE:
                steps.clear()
            steps[key] = _make(parts, count * self._resolution, learned)
        return steps[key]


def _make(parts: Parts, dt: float, learned: tuple[float, ...]) -> WindowStep:
    x = np.zeros(parts.layout.n_x)
    x[x.size - len(learned) :] = learned  # taken as known: at rest nothing depends on their errors
    at_rest, tau = Belief(x, parts.process.P0), np.zeros(parts.layout.n_theta + 1)
    transition = parts.steps.transition(at_rest, dt, tau)
    stack = parts.steps.rows(tuple(parts.sensors.rows), at_rest, tau)
    u = np.zeros(transition.B.shape[1])
    step = JointStep(transition.at(x, u), stack.at(x, u))
    T, T_transposed, V, noise = (
        np.ascontiguousarray(array)
        for array in (step.T[:-1], step.T[:-1].T, step.V[:-1], step.noise[:-1, :-1])
    )
    layout = Matrices(*(array.ctypes.data for array in (T_transposed, V, noise)))
    return WindowStep(step.m, T, T_transposed, V, noise, stack.R_total.diagonal().copy(), layout)
