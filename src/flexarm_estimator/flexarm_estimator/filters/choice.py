"""Which filter: what the settings ask for, made for one arm."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.filters.corrected import CorrectedSteps
from flexarm_estimator.filters.dynamics import Dynamics
from flexarm_estimator.filters.flow import StateFlow
from flexarm_estimator.filters.moving_arm import MovingArm
from flexarm_estimator.filters.served import ServedSteps
from flexarm_estimator.filters.slopes import Slopes
from flexarm_estimator.filters.step_source import StepSource
from flexarm_estimator.filters.tangent import TangentSteps
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.state.process import ProcessModel
from flexarm_estimator.state.sensors import SensorModels
from flexarm_estimator.tool.tip import Kinematics
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]


def _sigma_steps(flow: StateFlow, served: ServedSteps, force_cov: Array) -> StepSource:
    from flexarm_estimator.filters.sigma import SigmaSteps  # loads filterpy

    return SigmaSteps(flow, served, force_cov)


_MOVING: dict[str, Callable[[StateFlow, ServedSteps, Array], StepSource]] = {
    "corrected": CorrectedSteps,
    "extended": TangentSteps,
    "unscented": _sigma_steps,
}


class FilterMaker:
    """Makes the filter of any served model of one arm."""

    def __init__(self, arm: Kinematics, config: EstimatorConfig) -> None:
        """Keep what all models share.

        Raises:
            ValueError: The filter asked for needs the dynamics of the arm, and ``arm`` has only its tip.
        """
        self._arm, self._config = arm, config
        self._slopes: dict[tuple[int, ...], Slopes] = {}
        if config.filter in _MOVING and not isinstance(arm, Dynamics):
            raise ValueError(
                f"filter: '{config.filter}' needs the dynamics of the arm; its tip is not enough"
            )

    def make(
        self, model: ReducedModel, process: ProcessModel, models: SensorModels, use_compiler: bool = True
    ) -> StepSource:
        """Return where the steps of a served model come from; the first time this may compile."""
        served = ServedSteps(process, models)
        if self._config.filter not in _MOVING:
            return served
        flow = self.flow(model, process, models, use_compiler)
        return _MOVING[self._config.filter](flow, served, process.force_cov)

    def flow(
        self, model: ReducedModel, process: ProcessModel, models: SensorModels, use_compiler: bool = True
    ) -> StateFlow:
        """Return the nonlinear motion about a served model; the first time this may compile.

        Raises:
            ValueError: Of the arm only the tip is known.
        """
        if not isinstance(self._arm, Dynamics):
            raise ValueError("the dynamics of the arm is not known")
        rows = tuple(i for name in models.rows for i in model.outputs.rows(name))
        if rows not in self._slopes:
            self._slopes[rows] = Slopes(self._arm, rows, use_compiler)
        arm = MovingArm(self._arm, model, self._slopes[rows])
        flow = StateFlow(arm, model, process, models, self._config.force_averaging)
        flow.warm_up(model.xi0)
        return flow
