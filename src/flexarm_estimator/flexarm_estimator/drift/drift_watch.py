"""The drift watch of one arm: samples and torques in, running frequencies and alarms out.

It has a filter of its own beside the estimator's, with the same settings but without anything that learns the
stiffness away, so that it costs the estimator nothing. Time is an integer count of periods.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.adoption import map_parts
from flexarm_estimator.drift.healthy import HealthyModes
from flexarm_estimator.drift.judgement import Alarms, ModeNow, modes_now
from flexarm_estimator.drift.mode_drift import ModeDrift
from flexarm_estimator.drift.opinion import Opinion
from flexarm_estimator.drift.proposal import denial, proposal, suspicion
from flexarm_estimator.drift.running_point import RunningPoint, running_model
from flexarm_estimator.drift.sensitivity import watched_filter
from flexarm_estimator.drift.sensors_in_use import SensorsInUse
from flexarm_estimator.drift.settings import DriftConfig
from flexarm_estimator.drift.undrifted import undrifted
from flexarm_estimator.judging.gate import Gate
from flexarm_estimator.parts import PartsMaker
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.tool.tip import Kinematics
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
SETTLING = 1.0  # s after a start, or with other sensors, in which nothing is learned
LONGEST_GAP = 0.1  # s; after a longer one the filter starts anew
UNSEEN = 0.03  # s; after a longer one, in which nobody told the torque, it settles
LOOK = 0.1  # s between two judgements


class DriftWatch:
    """See the module.

    Attributes:
        modes: The watched modes as they ran at the last look; empty before.
        sensors: Whose samples it asks for.
    """

    def __init__(
        self,
        model: ReducedModel,
        kinematics: Kinematics,
        sensors: tuple[SensorSpec, ...],
        settings: tuple[EstimatorConfig, DriftConfig],
        dt: float,
    ) -> None:
        """Start at the operating point of a model.

        Args:
            model: Served model.
            kinematics: Of the tip.
            sensors: Of the description.
            settings: Of the estimator and of the watch.
            dt: Control period [s].

        Raises:
            ValueError: No sensor speaks in every period, or no mode is slow and lightly damped.
        """
        self._estimator, self._config = settings
        self._estimator = replace(self._estimator, filter="linear", stiffness_modes=0)
        gate = Gate.of(sensors, self._estimator)
        self._maker = PartsMaker(kinematics, sensors, self._estimator, gate)
        self._dt, self._specs = dt, sensors
        self._watched_modes = self._choose(model)
        self._point = self._described()
        self._use(model)
        self.sensors = tuple(name for name, _ in self._filter.sensors)
        self._in_use = SensorsInUse(sensors, self.sensors, dt)
        self._healthy_by: dict[frozenset[tuple[str, str]], HealthyModes] = {}
        self._forget_all(self._at_rest())
        self._last: int | None = None  # period of the last sample
        self._whole: int | None = None  # of the last one in which every sensor in use spoke
        self._started = self._older = 0  # period, and periods in a row that were of an earlier time
        self._looked = 0.0  # s
        self.modes: tuple[ModeNow, ...] = ()

    @property
    def model(self) -> ReducedModel:
        """Served model in use."""
        return self._model

    @property
    def said_of_sensors(self) -> str:
        """Which it goes on without and which are in doubt, with reasons; empty when none is."""
        return "; ".join(filter(None, (self._in_use.said, denial(self._alarms.undamped))))

    @property
    def alarms(self) -> Mapping[str, str]:
        """What is said of modes that have drifted, by name."""
        return self._alarms.told

    @property
    def proposal(self) -> str:
        """What to do about it; empty when no mode has drifted."""
        if not self._alarms.told:
            return ""
        if self._in_use.doubted or self._alarms.undamped:
            return suspicion(self._in_use.doubted, self._alarms.undamped)
        is_early = 0.0 <= self._looked - self._alarms.newest < self._config.memory
        return proposal(self._healthy.judged(self.modes), self._alarms.is_damping_alone, is_early)

    def said_of(self, mode: ModeNow) -> str:
        """Return what is said of a mode: its alarm, or whether it runs as it should."""
        return self._alarms.told.get(mode.name) or undrifted(mode, self._config)

    def adopt(self, model: ReducedModel) -> None:
        """Go on with another model of the same arm; what is known of its modes stays.

        Raises:
            ValueError: It is of another arm.
        """
        old = self._parts
        self._use(model)
        T = map_parts(old, self._parts).T
        self._drift.adopt(self._filter, T, T @ self._drift.x)

    def heed(self, opinion: Opinion) -> None:
        """Take what the estimator holds of the sensors, from the next step on."""
        self._in_use.heed(opinion)

    def step(self, period: int, samples: Mapping[str, Array], tau: Array) -> None:
        """Take what was sampled at the end of a period.

        Args:
            period: Its count, growing but where the clock is set back.
            samples: By sensor.
            tau: Torque held over it [N m or N], (n_theta,).
        """
        missed = self._missed(period)
        if missed is None:
            return
        u = np.append(tau, 1.0)
        if missed * self._dt > UNSEEN:
            self._started = period
        for _ in range(missed):
            self._drift.step(None, u)
        fit = self._in_use.read(samples)
        if self._in_use.has_changed:
            self._change_sensors(period)
        rows = [fit[name] for name, _ in self._filter.sensors if name in fit]
        is_whole = len(rows) == len(self._filter.sensors) and not self._in_use.is_blind
        y = np.concatenate(rows) if is_whole else None
        if is_whole:
            self._anew_after_silence(period)
        elif self._whole is None and not self.modes:
            return
        elapsed = (period - self._started) * self._dt
        self._drift.step(y, u, counts=elapsed > SETTLING)
        if period % max(1, round(LOOK / self._dt)) == 0 and elapsed > SETTLING:
            self._look(elapsed - SETTLING, period * self._dt)

    def _look(self, elapsed: float, t: float) -> None:
        """Judge the modes, and go along with those that have left the point about which slopes hold."""
        self._looked = t
        now = modes_now(self.model, self._filter.modes, self._drift.deltas(), self._point.ratio)
        healthy = self._healthy
        self.modes = self._point.settled(healthy.compare(now, elapsed), t)
        judged = healthy.judged(self.modes)
        self._alarms.look(judged, t)
        shift = self._point.step(judged, t)
        if shift is not None:
            old = self._parts
            self._use(self._model)
            self._drift.move(self._filter, map_parts(old, self._parts).T, shift)

    def _change_sensors(self, period: int) -> None:
        """Go on with the filter of other sensors; what a false one has told is forgotten."""
        old = self._parts
        self._maker = self._maker.retuned(self._in_use.specs, self._estimator)
        if self._in_use.is_misled:
            self._point = self._described()
        self._use(self._model)
        T = map_parts(old, self._parts).T
        if self._in_use.is_misled:
            self._forget_all(T @ self._drift.x)
        else:
            self._drift.adopt(self._filter, T, T @ self._drift.x)
        self._started = period

    def _missed(self, period: int) -> int | None:
        """Return how many periods passed unseen, none of a long gap; None when the sample is old.

        A stray one is old; after a row of them the clock has been set back, and time goes on from there.
        """
        last = self._last
        if last is not None and period <= last:
            self._older += 1
            if self._older * self._dt <= LONGEST_GAP:
                return None
            last, self._whole, self._started = None, None, period
        self._last, self._older = period, 0
        if last is None:
            return 0
        if (period - last) * self._dt > LONGEST_GAP:
            self._drift.forget(period - last - 1)
            return 0
        return period - last - 1

    def _anew_after_silence(self, period: int) -> None:
        """Start anew when no period was whole for too long: the state has gone its own way since."""
        whole, self._whole = self._whole, period
        if whole is None or (period - whole) * self._dt > LONGEST_GAP:
            self._started = period
            self._drift.restart(self._at_rest())

    def _use(self, model: ReducedModel) -> None:
        self._model = model
        running = running_model(model, self._watched_modes, self._point.ratio)
        self._parts = parts = self._maker.make(running, use_compiler=False)
        self._filter = watched_filter(parts, self._specs, self._dt, self._watched_modes)

    @property
    def _healthy(self) -> HealthyModes:
        """How modes should read with the sensors in use: what the model leaves out moves each otherwise."""
        return self._healthy_by.setdefault(self._in_use.channels, HealthyModes(self._config))

    def _described(self) -> RunningPoint:
        return RunningPoint([f"mode_{mode + 1}" for mode in self._watched_modes])

    def _forget_all(self, x: Array) -> None:
        """Go on from a state with nothing learned, and nothing told."""
        self._drift = ModeDrift(self._filter, x, self._dt, self._config.memory)
        self._alarms = Alarms(self._config)

    def _at_rest(self) -> Array:
        x = np.zeros(self._parts.layout.n_x)
        x[: self.model.n] = self.model.xi0
        return x

    def _choose(self, model: ReducedModel) -> tuple[int, ...]:
        turned = model.omega * self._dt / (2 * np.pi)
        rings = (turned < self._config.fastest) & (model.zeta < self._config.largest_damping)
        chosen = tuple(int(i) for i in np.flatnonzero(rings))
        if not chosen:
            raise ValueError("no served mode is slow enough and lightly damped: there is nothing to watch")
        return chosen
