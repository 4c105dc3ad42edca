"""The gate: the loop that is about to be closed, with the arm as it may really be, before anything moves.

It knows the description, the law and its settings; the filter comes as matrices from the estimator that runs.
The full plant is the description's with more modes per body; nothing of it comes from the simulated rig.
A latency is judged as the next whole number of periods.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.laws import LAWS, LawInputs
from flexarm_controller.margins.case import Case, examine
from flexarm_controller.margins.full_plant import build_plant, full_model
from flexarm_controller.margins.law_gain import find_law_gain
from flexarm_controller.margins.loop import close_loop
from flexarm_controller.margins.verdict import frequency_errors, verdict
from flexarm_controller.program.delay import split_delay
from flexarm_controller.settings import MarginConfig
from flexarm_model.description import ManipulatorConfig
from flexarm_model.model_order import with_more_modes
from flexarm_model.reduced_model import ReducedModel
from flexarm_model.reduced_tree import ReducedTree
from flexarm_model.steady_filter import SteadyFilter

Array = NDArray[np.float64]


class Gate:
    """Judges closed loops of one arm and one law."""

    def __init__(self, arm: ManipulatorConfig, inputs: LawInputs, config: MarginConfig) -> None:
        """Keep what all models share; the finer model is built when the first one is judged.

        Args:
            arm: Its description.
            inputs: What the law is built from.
            config: What is wanted.
        """
        self._arm, self._config = arm, config
        whole, share = split_delay(inputs.mpc, inputs.config.period)
        delay = whole + (share > 0.0)
        # at rest no other model is to come, and no answer may depend on the clock
        mpc = replace(inputs.mpc, delay_periods=delay, latency=0.0, foresight=False, time_limit=0.0)
        self._inputs = replace(inputs, mpc=mpc)

    def cases(self, model: ReducedModel, filter_: SteadyFilter) -> list[Case]:
        """Return the loop at the pose of a served model, with every frequency error.

        Raises:
            ValueError: Model and filter do not belong together, or the law has no answer at rest.
        """
        if filter_.model_id != model.model_id:
            raise ValueError(f"filter of model {filter_.model_id}, law of model {model.model_id}")
        inputs, dt = self._inputs, self._inputs.config.period
        if not math.isclose(filter_.dt, dt):
            raise ValueError(f"the filter's period is {filter_.dt} s, the law's {dt} s")
        delay = inputs.mpc.delay_periods
        planner = LAWS[inputs.config.law](model, inputs)
        law = find_law_gain(planner, model, inputs.limits.effort, delay)
        full = full_model(self._tree, model.pose, self._config.fastest_mode / dt)
        found = []
        for error in frequency_errors(self._config):
            plant = build_plant(full, filter_.rows, dt, error)
            found.append(examine(close_loop(plant, filter_, law, delay), model.pose, error, dt))
        return found

    def judge(self, model: ReducedModel, filter_: SteadyFilter) -> str:
        """Return why the arm must not move with this filter and law, naming the mode; empty when it may."""
        try:
            return verdict(self.cases(model, filter_), self._config, self._inputs.config.period)
        except (ValueError, np.linalg.LinAlgError) as error:
            return f"margins: {error}"

    @cached_property
    def _tree(self) -> ReducedTree:
        return ReducedTree(with_more_modes(self._arm, self._config.extra_modes), use_compiler=False)
