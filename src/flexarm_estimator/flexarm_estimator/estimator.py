"""The estimator: fuses samples of any age into the state of the arm.

``step`` never raises for anything that samples, torques or clocks may bring, and nothing it returns
is ever NaN or infinite.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.adoption import carry_over
from flexarm_estimator.biases.pulled_plugs import PulledPlugs
from flexarm_estimator.clock import Clock
from flexarm_estimator.estimate import Estimate
from flexarm_estimator.exclusion.fault_exclusion import FaultExclusion
from flexarm_estimator.filter import Belief
from flexarm_estimator.history import History, Instant
from flexarm_estimator.judging.gate import Gate
from flexarm_estimator.judging.health import Health
from flexarm_estimator.judging.reception import Reception
from flexarm_estimator.judging.sample_judge import Verdict
from flexarm_estimator.judging.switched_channels import have_same_channels
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.messages.torque_input import torque_input
from flexarm_estimator.parts import Parts, PartsMaker
from flexarm_estimator.recomputation import compute
from flexarm_estimator.robust.moving_horizon import horizon_of
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.tool.report import TipReporter
from flexarm_estimator.tool.tip import Kinematics
from flexarm_estimator.watches.stamp_delays import StampDelays
from flexarm_estimator.watches.table import Watches
from flexarm_estimator.watches.watch import View
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.settings.parameters import validate

Array = NDArray[np.float64]
_START = 0.005  # s; the fixed start lies this long before the first step, whose samples count


class Estimator:
    """State of one arm, x = [theta; eta; theta'; eta'; d; b; w; s; p] with covariance, and its tip.

    Attributes:
        model, specs, config: The served model in use; the sensors; settings.
        health: Counts and states of the sensors.
        told: What the last step returned, and the parts it belongs to; None before the first.
    """

    def __init__(
        self,
        model: ReducedModel,
        kinematics: Kinematics,
        sensors: tuple[SensorSpec, ...],
        config: EstimatorConfig,
        *,
        use_compiler: bool = True,
    ) -> None:
        """Start at the operating point of the model, knowing little.

        Args:
            model: Served model.
            kinematics: Pose and Jacobian of the tip.
            sensors: Sensors of the description.
            config: Settings.
            use_compiler: False computes with NumPy instead of machine code: the same, slower.

        Raises:
            ParameterError: A setting is outside its range, or does not go with another.
            KeyError: The model lacks an output row of a sensor.
        """
        validate(config)
        self.specs, self.config, self._use_compiler = sensors, config, use_compiler
        self._gate = Gate.of(sensors, config, use_compiler)
        self._maker = PartsMaker(kinematics, sensors, config, self._gate)
        self._delays, self._horizon = StampDelays(sensors), horizon_of(config)
        self._watches = Watches(sensors, config, self._delays)
        self._use(self.prepare(model))
        self.health = Health(sensors, {name: m.axes for name, m in self._parts.sensors.all().items()}, config)
        self._exclusion = FaultExclusion(self._gate, self.health, config.distrust)
        self._u = np.append(np.zeros(model.n_theta), 1.0)
        self._clock, self._t, self._began, self._is_known = Clock(), 0.0, 0.0, False
        self._restart(0.0, self._parts.at_rest())
        self._tip = TipReporter()
        self._tip.describe(self._parts.tip, self._history.now.belief)
        self.told: tuple[Estimate, Parts] | None = None

    def step(self, measurements: Sequence[Measurement], tau: Array, t: float) -> Estimate:
        """Fuse what has arrived and return the state at ``t``.

        Args:
            measurements: Samples of any sensor, age and order.
            tau: Torque that acted during the period that ends at ``t`` [N m] or [N], (n_theta,).
            t: Now [s].

        Returns:
            The estimate; its status says whether it may be used.
        """
        trouble, history = self._follow_clock(t) + self._take_torque(tau), self._history
        self._plugs.unlearn(history, self._parts, self._t)
        first = history.advance(self._t, self._u)
        arrived = self._delays.undo(measurements)
        samples, scan, singles = self._reception.admit(arrived, self._t, history.oldest)
        fit = self.health.pick_sound(singles)
        self._gate.meet(fit, scan)
        touched = [first, *map(history.insert, fit), *map(history.insert_scan, [scan] if scan else [])]
        verdicts = self._compute(touched) + self._resolve()
        self._gate.note_return(self.health.note_verdicts(verdicts, self._t))
        if self._horizon is not None:
            self._horizon.settle(history.instants)
        now, is_ordinary = history.now, all([verdict.is_accepted for verdict in verdicts])
        seen = self._t, self._u, now.belief, samples, verdicts, now.inputs, is_ordinary, history.instants
        self._heed(View(*seen))
        history.forget(self._gate.needs(self._t))
        self.told = self._estimate(trouble), self._parts
        return self.told[0]

    def prepare(self, model: ReducedModel) -> Parts:
        """Build what belongs to a model ahead of its time.

        Raises:
            KeyError: It lacks an output row of a sensor.
        """
        return self._maker.make(model, self._use_compiler)

    def adopt(self, model: ReducedModel | Parts) -> None:
        """Go on with another served model of the same arm; the recent past keeps the one of its time.

        Raises:
            ValueError: It is of another arm.
            KeyError: It lacks an output row of a sensor.
        """
        parts = model if isinstance(model, Parts) else self.prepare(model)
        mapping = carry_over(self._parts, parts)
        self._use(parts)
        self._history.enter(parts, mapping)

    def reset(self) -> None:
        """Forget the state; the next step starts anew."""
        self._clock, self._is_known = Clock(), False

    def set_belief(self, belief: Belief) -> None:
        """Go on from a state that is known from elsewhere; samples from before it are ignored.

        Before the first step, also after a reset, it is the state that the next step begins with.
        """
        self._is_known = not self._clock.is_running
        self._began = self._t
        self._history = History(Instant(self._t, self._u, self._parts, belief), self.config.history)

    def retune(self, specs: tuple[SensorSpec, ...], config: EstimatorConfig) -> None:
        """Go on with other noise, or other channels: then all but the state begins anew, without its past.

        Raises:
            ParameterError: A setting is outside its range, or does not go with another.
        """
        validate(config)
        self._horizon = horizon_of(config)
        is_anew = not have_same_channels(specs, self.specs)
        self.specs, self.config, self._maker = specs, config, self._maker.retuned(specs, config)
        self._reception.retune(specs, config)
        self._gate.retune(specs)
        self._watches.retune(specs)
        self.adopt(self.model)
        if is_anew:
            belief, delays = self._history.now.belief, self._delays.in_use
            self._restart(self._t, belief)
            if self._clock.is_running or self._is_known:  # else a reset has forgotten it
                self.set_belief(belief)
            self._delays.resume(delays)

    def figures(self) -> dict[str, dict[str, float]]:
        """Return what the watches can tell in numbers, by sensor and name with unit ("latency [s]")."""
        return self._watches.figures()

    @property
    def past(self) -> tuple[Parts, Sequence[Instant]]:
        """Parts in use and recent instants as computed, for those who look back; read only."""
        return self._parts, self._history.instants

    def _use(self, parts: Parts) -> None:
        self.model, self._parts = parts.model, parts
        self._watches.use(parts)

    def _restart(self, t: float, belief: Belief, is_contested: bool = False) -> None:
        """Forget everything but a state just before ``t``."""
        self._t = self._began = t
        self._history = History(Instant(t - _START, self._u, self._parts, belief), self.config.history)
        self._reception = Reception(self.specs, self.config, self.health)
        self._plugs = PulledPlugs(self.specs, self.health)
        self.health.restart(t, is_contested)
        self._gate.restart()
        self._exclusion.restart(t)
        self._watches.restart(t)

    def _follow_clock(self, t: float) -> list[str]:
        """Move the own clock to ``t``; start anew when it jumps. Returns what is wrong with ``t``."""
        must_restart, trouble = self._clock.follow(t, self.config.max_gap, self.config.future_tolerance)
        self._t = self._clock.t
        if must_restart:
            belief = self._history.now.belief
            self._restart(t, belief if self._is_known else self._parts.stopped(belief.x))
        self._is_known = self._is_known and not self._clock.is_running
        return trouble

    def _take_torque(self, tau: Array) -> list[str]:
        """Hold ``tau`` over the period; keep the last one when it cannot be used."""
        u = torque_input(tau, self.model.n_theta)
        self._u = self._u if u is None else u
        return ["torque is not usable"] if u is None else []

    def _compute(self, touched: Sequence[int]) -> list[Verdict]:
        """Compute all instants from the first of those ``touched`` on."""
        return compute(self._history.instants, max(1, min(touched)))

    def _resolve(self) -> list[Verdict]:
        """Fuse what the gate had held back and lets go now; return the final verdicts on what it held."""
        released, dropped = self._gate.resolve(self._history.oldest)
        return dropped + (self._compute([self._history.insert(s) for s in released]) if released else [])

    def _heed(self, view: View) -> None:
        """Ask the watches; take what a sensor at fault has said out of the recent past."""
        findings = self._watches.look(view, self.health.heed)
        if findings or self._exclusion.is_needed or not view.is_ordinary:
            for finding in self._exclusion.look(view, self._history, findings):
                self.health.heed(finding, "FaultExclusion")
        if touched := [self._history.withdraw(f.sensor, f.since) for f in findings if f.since < math.inf]:
            self._compute(touched)

    def _estimate(self, trouble: list[str]) -> Estimate:
        t, parts, belief = self._t, self._parts, self._history.now.belief
        lost, (tip, doubt) = self._exclusion.contradiction(t), self._tip.describe(parts.tip, belief)
        doubt = doubt or (parts.possible.refusal(belief.x) if lost or not self.health.is_all_sound else "")
        if doubt:  # nothing can be compared with such a state any more
            self._restart(t, parts.at_rest())
            tip, _ = self._tip.describe(parts.tip, self._history.now.belief)
        reports = self.health.reports(t)
        said = "; ".join([words for words in (*trouble, self._gate.doubt(t)) if words])
        status, reason = self.health.judge(t, tip.sigma, reports, said, doubt or lost)
        if status == "lost" and self.health.is_stranded(t):  # who excluded them knew no more than they
            self._restart(t, parts.stopped(self._history.now.belief.x), is_contested=True)
        return Estimate(
            t, self.model.model_id, tip.x, tip.P, parts.layout, status, reason, reports, t - self._began,
            tip.T_world_tip, tip.twist, tip.cov_pose, tip.cov_twist,
        )  # fmt: skip
