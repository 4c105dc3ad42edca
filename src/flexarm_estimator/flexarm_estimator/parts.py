"""Everything of the estimator that belongs to one served model; built ahead of its time, used at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.biases.bias_observability import observable_biases
from flexarm_estimator.biases.bias_states import bias_specs
from flexarm_estimator.filter import Belief
from flexarm_estimator.filters.choice import FilterMaker
from flexarm_estimator.filters.step_source import StepSource
from flexarm_estimator.fusion import Fusion
from flexarm_estimator.judging.gate import Gate
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.state.model_errors import with_model_errors
from flexarm_estimator.state.possible import PossibleStates
from flexarm_estimator.state.process import ProcessModel
from flexarm_estimator.state.sensors import SensorModels, build_sensor_models
from flexarm_estimator.state.state_layout import StateLayout
from flexarm_estimator.tool.machine_tip import make_tip
from flexarm_estimator.tool.tip import Kinematics, Tip
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Parts:
    """What belongs to one model.

    Attributes:
        model: Served model.
        tree_mass: Of the tree at its pose, (n_q, n_q).
        process, tip, sensors, possible, steps, fusion: What is made of it.
    """

    model: ReducedModel
    tree_mass: Array
    process: ProcessModel
    tip: Tip
    sensors: SensorModels
    possible: PossibleStates
    steps: StepSource
    fusion: Fusion

    @property
    def layout(self) -> StateLayout:
        """Where things stand in the state."""
        return self.process.layout

    def at_rest(self) -> Belief:
        """Return the state at rest where the model is linear, of an arm of which little is known."""
        x = np.zeros(self.layout.n_x)
        x[: self.model.n] = self.model.xi0
        return Belief(x, self.process.P0)

    def stopped(self, x: Array) -> Belief:
        """Return the state ``x`` (n_x,) after all that moves has died out, little known again.

        Axes, biases, sag and what was learned stay as a guess. Where the axes cannot be there it is the one
        at rest.
        """
        x, layout = x.copy(), self.layout
        x[layout.n_theta : layout.b.start] = 0.0
        x[layout.eta][: layout.n_s] = x[layout.s]
        return self.at_rest() if self.possible.refusal(x) else Belief(x, self.process.P0)


class PartsMaker:
    """Makes the parts of any served model of one arm."""

    def __init__(
        self,
        kinematics: Kinematics,
        specs: tuple[SensorSpec, ...],
        config: EstimatorConfig,
        gate: Gate,
        filters: FilterMaker | None = None,
    ) -> None:
        """Keep what all models share; ``filters`` that are made already are taken over."""
        self._kinematics, self._gate, self._config = kinematics, gate, config
        self._specs = with_model_errors(specs, config)
        self._filters = filters or FilterMaker(kinematics, config)

    def retuned(self, specs: tuple[SensorSpec, ...], config: EstimatorConfig) -> PartsMaker:
        """Return one for other noise; gate and filter stay."""
        return PartsMaker(self._kinematics, specs, config, self._gate, self._filters)

    def make(self, model: ReducedModel, use_compiler: bool = True) -> Parts:
        """Build the parts of a model.

        Raises:
            KeyError: It lacks an output row of a sensor.
        """
        known = bias_specs(self._specs)
        kept = {name: known[name] for name in observable_biases(model, self._specs)}
        borne = self._kinematics.borne(model.q0) if self._config.sag_share > 0.0 else None
        process = ProcessModel(model, self._config, kept, borne)
        tip = make_tip(model, self._kinematics, process.system.n_x, use_compiler)
        sensors = build_sensor_models(self._specs, model, process.system, tip)
        steps = self._filters.make(model, process, sensors, use_compiler)
        fusion = Fusion(process, sensors, self._gate, use_compiler, steps)
        mass, possible = self._kinematics.mass_matrix(model.q0), PossibleStates(self._specs, sensors.rows)
        return Parts(model, mass, process, tip, sensors, possible, steps, fusion)
