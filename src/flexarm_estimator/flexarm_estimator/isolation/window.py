"""A piece of the recent past, and the joint steps through it."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief
from flexarm_estimator.isolation.known_biases import KnownBiases
from flexarm_estimator.parts import Parts
from flexarm_estimator.state.process import Transition
from flexarm_estimator.steps.bilinear import Slope, tangent
from flexarm_estimator.steps.joint_step import JointStep

Array = NDArray[np.float64]
_CACHE_SIZE = 200  # joint steps of a model
_MODELS = 8  # whose steps are kept: more than a window has, for what is kept of a model takes 0.4 MB


@dataclass(frozen=True)
class Window:
    """The recent past.

    Attributes:
        t: Stamps [s], (k,).
        u: [tau; 1] held until then, k times (n_u + 1,).
        y: What the channels said, NaN where nothing, (k, m).
        parts: Model in use at each.
        theta: Axes at the start, a guess [rad] or [m], (n_theta,).
        learned: Parameters of the model as learned, a guess, (n_p,).
        biases: At the start; None: as little known as ever.
    """

    t: Array
    u: Sequence[Array]
    y: Array
    parts: list[Parts]
    theta: Array
    learned: tuple[float, ...] = ()
    biases: KnownBiases | None = None

    @cached_property
    def periods(self) -> list[float]:
        """From one stamp to the next [s], k - 1 of them."""
        return [after - before for before, after in pairwise(self.t.tolist())]

    def is_alike(self, k: int, other: int, resolution: float) -> bool:
        """Return whether two steps are of the same model and, but for ``resolution`` [s], as long."""
        periods, parts = self.periods, self.parts
        return parts[k] is parts[other] and abs(periods[k - 1] - periods[other - 1]) < resolution

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
        slopes: What one unit of every learned parameter adds to T and V.
        layout: The same for machine code.
    """

    m: int
    T: Array
    T_transposed: Array
    V: Array
    noise: Array
    floor: Array
    slopes: tuple[Slope, ...]
    layout: Matrices

    def about(self, x: Array, u: Array) -> WindowStep:
        """Return the tangent at the state x (n_x,) before the step and the inputs u (n_inputs,)."""
        if not self.slopes:
            return self
        T, V = tangent(self.T, self.V, self.slopes, (x, u))
        return _step(self.m, T, V, self.noise, self.floor)


class StepMaker:
    """Joint steps of all rows, kept per model and period.

    Attributes:
        resolution: Periods that differ by less are one [s].
    """

    def __init__(self, resolution: float, most: Array | float = math.inf, share: float = 1.0) -> None:
        """Take periods as equal that differ by less than ``resolution`` [s].

        Args:
            resolution: [s].
            most: Variance that every row has at most, without the force noise it feels, (m,).
            share: Of the intensity of the process noise that is counted on.
        """
        self.resolution, self._most, self._share = resolution, most, share
        self._steps: dict[int, tuple[Parts, dict[int, WindowStep]]] = {}
        self._others: dict[float, StepMaker] = {}

    def counting(self, share: float) -> StepMaker:
        """Return one that counts on a share of the process noise this one does; the same every time."""
        if share == 1.0:
            return self
        if share not in self._others:
            self._others[share] = StepMaker(self.resolution, self._most, self._share * share)
        return self._others[share]

    def step(self, parts: Parts, dt: float) -> WindowStep:
        """Return the step of a model over ``dt`` [s]; what is learned of it is at zero."""
        count = max(1, round(dt / self.resolution))
        if id(parts) not in self._steps:
            while len(self._steps) >= _MODELS:
                del self._steps[next(iter(self._steps))]
            self._steps[id(parts)] = parts, {}
        steps = self._steps[id(parts)][1]
        if count not in steps:
            if len(steps) >= _CACHE_SIZE:
                steps.clear()
            steps[count] = _make(parts, count * self.resolution, self._most, self._share)
        return steps[count]


def _make(parts: Parts, dt: float, most: Array | float, share: float) -> WindowStep:
    at_rest, tau = Belief(np.zeros(parts.layout.n_x), parts.process.P0), np.zeros(parts.layout.n_theta + 1)
    transition = parts.steps.transition(at_rest, dt, tau)
    stack = parts.steps.rows(tuple(parts.sensors.rows), at_rest, tau)
    R = stack.R - np.diag((stack.R.diagonal() - most).clip(0.0))
    stack = replace(stack, R=R, R_total=R + share * (stack.R_total - stack.R))
    transition = replace(transition, Q=share * transition.Q, force_cross=share * transition.force_cross)
    step = JointStep(transition, stack)
    pairs = zip(transition.slopes, stack.slopes, strict=True)
    slopes = tuple(_join(transition, stack.C, after, at) for after, at in pairs)
    floor = stack.R_total.diagonal().copy()
    return _step(step.m, step.T[:-1], step.V[:-1], step.noise[:-1, :-1], floor, slopes)


def _join(transition: Transition, C: Array, after: Slope, at: Slope) -> Slope:
    """Return what a parameter adds to [y; x+] where it adds ``after`` to x+ and ``at`` to y."""
    of_x = C @ after.of_x + at.of_x @ transition.A
    of_u = C @ after.of_u + at.of_x @ transition.B + at.of_u
    return Slope(np.vstack([of_x, after.of_x]), np.vstack([of_u, after.of_u]))


def _step(
    m: int, T: Array, V: Array, noise: Array, floor: Array, slopes: tuple[Slope, ...] = ()
) -> WindowStep:
    T, T_transposed, V, noise = (np.ascontiguousarray(array) for array in (T, T.T, V, noise))
    layout = Matrices(*(array.ctypes.data for array in (T_transposed, V, noise)))
    return WindowStep(m, T, T_transposed, V, noise, floor, slopes, layout)
