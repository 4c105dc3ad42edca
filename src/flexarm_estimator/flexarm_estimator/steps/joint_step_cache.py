"""Joint steps of a filter: made once per period and set of sensors if they are constant, else every time."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief, predict
from flexarm_estimator.filters.step_source import StepSource
from flexarm_estimator.steps.joint_step import JointStep
from flexarm_estimator.steps.records import RecordPool

Array = NDArray[np.float64]
_SIZE = 512  # steps


class JointStepCache:
    """Joint steps of one filter."""

    def __init__(self, source: StepSource, names: Iterable[str]) -> None:
        """Start empty; ``source`` is the filter, ``names`` are the sensors that are rows, in their order."""
        self._source, self._names = source, tuple(names)
        self._steps: dict[tuple[float, tuple[str, ...]], JointStep] = {}
        self._pool = RecordPool()
        self._known: dict[tuple[object, ...], JointStep] = {}  # the same by what was asked for

    def step(self, before: Belief, dt: float, u: Array, sensors: Iterable[str]) -> JointStep:
        """Return the step from ``before`` over ``dt`` [s] under the inputs ``u``, and the rows at its end.

        ``sensors`` are those that say something there, in any order; not all have to be rows.
        """
        asked = dt, *sensors  # rounding makes many periods of one
        known = self._known.get(asked)
        if known is not None:
            return known
        source, names = self._source, tuple([name for name in self._names if name in asked])
        transition = source.transition(before, dt, u)
        if not source.keeps_matrices:
            transition = transition.at(before.x, u)  # the served model may stand in
            prior = predict(before, transition, u)
            stack = source.rows(names, prior, u).at(prior.x, u) if names else None
            return JointStep(transition, stack, self._pool)
        step = self._steps.get((transition.dt, names))
        if step is None:
            if len(self._steps) >= _SIZE:
                self._steps.clear()
            stack = source.rows(names, before, u) if names else None
            step = JointStep(transition, stack, self._pool)
            self._steps[transition.dt, names] = step
        if len(self._known) >= _SIZE:
            self._known.clear()
        self._known[asked] = step
        return step
