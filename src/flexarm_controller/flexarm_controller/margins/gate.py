"""The gate: the loop that is about to be closed, with the arm as it may really be, before anything moves.

It knows the description, the law and its settings; the filter comes as matrices from the estimator that runs.
The full plant is the description's with more modes per body; nothing of it comes from the simulated rig.
A latency is judged as the next whole number of periods. A law that is firm for a short time is judged twice:
its ordinary weights by their margins, the firm ones by what they let grow in that time.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from flexarm_controller.firm_mpc import FirmMpc
from flexarm_controller.laws import LAWS, LawInputs, Planner
from flexarm_controller.margins.case import Case, examine
from flexarm_controller.margins.full_plant import FullPlant, build_plant, full_model
from flexarm_controller.margins.law_gain import find_law_gain
from flexarm_controller.margins.loop import ClosedLoop, close_loop
from flexarm_controller.margins.short_law import ShortCase, examine_short
from flexarm_controller.margins.verdict import firm_verdict, frequency_errors, unread, verdict
from flexarm_controller.program.delay import in_whole_periods, torques_kept
from flexarm_controller.settings import MarginConfig
from flexarm_model.bodies.model_order import with_more_modes
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.process.punctual import ordinary_priority
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.steady_filter import SteadyFilter
from flexarm_model.tree.reduced_tree import ReducedTree


@dataclass(frozen=True)
class Look:
    """What was looked at: the loop of the ordinary law, and that of a firm one if there is one."""

    cases: list[Case]
    firm: list[ShortCase]


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
        # at rest no other model is to come, the model knows the torque, and no answer may depend on the clock
        whole = in_whole_periods(inputs.mpc, inputs.config.period)
        mpc = replace(whole, foresight=False, arm_torque=False, time_limit=0.0)
        self._inputs = replace(inputs, mpc=mpc)

    def cases(self, model: ReducedModel, filter_: SteadyFilter) -> list[Case]:
        """Return the loop at the pose of a served model, with every frequency error; see ``look``."""
        return self.look(model, filter_).cases

    def look(self, model: ReducedModel, filter_: SteadyFilter) -> Look:
        """Return everything that is looked at, at the pose of a served model, with every frequency error.

        Raises:
            ValueError: Model and filter do not belong together, or the law has no answer at rest.
        """
        inputs, dt = self._inputs, self._inputs.config.period
        if filter_.model_id != model.model_id:
            raise ValueError(f"filter of model {filter_.model_id}, law of model {model.model_id}")
        if not math.isclose(filter_.dt, dt):
            raise ValueError(f"the filter's period is {filter_.dt} s, the law's {dt} s")
        planner = LAWS[inputs.config.law](model, inputs)
        full = full_model(self._tree, model.pose, self._config.fastest_mode / dt)
        plants = {
            error: build_plant(full, filter_.rows, dt, error) for error in frequency_errors(self._config)
        }
        loops = self._close(planner, model, filter_, plants)
        cases = [examine(loop, model.pose, error, dt) for error, loop in loops.items()]
        if not isinstance(planner, FirmMpc):
            return Look(cases, [])
        firm = self._close(planner.firm, model, filter_, plants)
        return Look(cases, examine_short(firm, loops.values(), model.pose, planner.lasts, dt))

    def _close(
        self, law: Planner, model: ReducedModel, filter_: SteadyFilter, plants: Mapping[float, FullPlant]
    ) -> dict[float, ClosedLoop]:
        """Return the loop of a law with every plant, by frequency error."""
        delay = torques_kept(self._inputs.mpc, self._inputs.config.period)
        gain = find_law_gain(law, model, self._inputs.limits.effort, delay)
        return {error: close_loop(plant, filter_, gain, delay) for error, plant in plants.items()}

    @ordinary_priority()  # it takes seconds, in which an estimator on the same core would tell no state
    def judge(self, model: ReducedModel, filter_: SteadyFilter) -> str:
        """Return why the arm must not move with this filter and law, naming the mode; empty when it may."""
        try:
            look = self.look(model, filter_)
        except (ValueError, np.linalg.LinAlgError) as error:
            return f"margins: {error}"
        law = self._inputs.config
        said = verdict(look.cases, self._config, law.period, model.eta_names, law.law)
        said = said or firm_verdict(look.firm, self._config)
        return said and said + unread(self._arm)

    @cached_property
    def _tree(self) -> ReducedTree:
        return ReducedTree(with_more_modes(self._arm, self._config.extra_modes), use_compiler=False)
