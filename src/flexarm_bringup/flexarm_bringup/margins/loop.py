"""The closed loop of a manipulator at a pose: its estimator, its law and the spill-over gate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.laws import LawInputs
from flexarm_controller.limits import limits_of
from flexarm_controller.margins.case import Case
from flexarm_controller.margins.gate import Gate, Look
from flexarm_controller.settings import ControllerConfig, MarginConfig, MpcConfig
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.settled import settled_filter
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]


class Loop:
    """A manipulator under its estimator and its law, as they are configured."""

    def __init__(
        self,
        config: ManipulatorConfig,
        estimator: EstimatorConfig,
        laws: tuple[ControllerConfig, MpcConfig],
        margins: MarginConfig | None = None,
    ) -> None:
        """Keep the settings; the control rate is the description's.

        Args:
            config: The manipulator.
            estimator: Settings of the estimator.
            laws: Settings of the controller and of its predictive law.
            margins: What is wanted.
        """
        self.config, self.dt, self._estimator = config, 1.0 / config.rate_hz, estimator
        self.tree = ReducedTree(config, use_compiler=False)
        law = replace(laws[0], period=self.dt)
        inputs = LawInputs(limits_of(config), law, replace(laws[1], time_limit=0.0), config)
        self.gate = Gate(config, inputs, margins or MarginConfig())

    def cases(self, pose: Array | None = None) -> list[Case]:
        """Return the closed loop at a pose, home if None, with every frequency error.

        Raises:
            ValueError: There is no model at the pose, or the loop cannot be judged there.
        """
        return self.look(pose).cases

    def look(self, pose: Array | None = None) -> Look:
        """Return the same, and what a firm law does; see ``cases``."""
        estimator = self.estimator(pose)
        return self.gate.look(estimator.model, settled_filter(estimator, self.dt))

    def judge(self, pose: Array | None = None) -> str:
        """Return why the arm must not move at a pose, naming the mode; empty when it may."""
        estimator = self.estimator(pose)
        return self.gate.judge(estimator.model, settled_filter(estimator, self.dt))

    def estimator(self, pose: Array | None = None) -> Estimator:
        """Return the estimator at a pose."""
        model = linearize(self.tree, pose)
        return Estimator(model, self.tree, self.config.sensors, self._estimator, use_compiler=False)
