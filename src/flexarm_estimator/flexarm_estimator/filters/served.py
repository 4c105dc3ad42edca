"""Steps of the linear filter: those of the served model, made once per period and set of sensors."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filter import Belief
from flexarm_estimator.filters.step_source import Look, StepSource
from flexarm_estimator.state.process import ProcessModel, Transition
from flexarm_estimator.state.sensors import MeasurementModel, SensorModels
from flexarm_estimator.steps.stack import Stack, stack_rows

Array = NDArray[np.float64]


class ServedSteps(StepSource):
    """Constant matrices; poses are linearised at the mean.

    Attributes:
        process: Process model.
    """

    is_constant = keeps_matrices = True
    dependent = None

    def __init__(self, process: ProcessModel, models: SensorModels) -> None:
        """Bind the parts; rows are stacked when a combination of sensors first occurs."""
        self.process, self._models = process, models
        self._stacks: dict[tuple[str, ...], Stack] = {}

    @property
    def names(self) -> tuple[str, ...]:
        """Sensors that are rows."""
        return tuple(self._models.rows)

    def transition(self, before: Belief, dt: float, u: Array) -> Transition:
        """Return the step of the process model."""
        return self.process.step(dt)

    def rows(self, names: tuple[str, ...], prior: Belief, u: Array) -> Stack:
        """Return the rows of the served model."""
        if names not in self._stacks:
            rows = [self._models.rows[name] for name in names]
            self._stacks[names] = stack_rows(rows, self.process.force_cov)
        return self._stacks[names]

    def whole_rows(self) -> Stack:
        """Return the rows of all sensors, at least one, with the channels that are switched off."""
        return stack_rows([model.whole for model in self._models.rows.values()], self.process.force_cov)

    def look(self, model: MeasurementModel, y: Array, belief: Belief, u: Array) -> Look:
        """Return innovation and Jacobian at the mean."""
        return Look(*model.linearise(y, belief.x, u))
