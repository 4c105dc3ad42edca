"""The drift watch between messages: sensors, torques and models in, diagnostics out; no topics and no clock.

Messages of an instant arrive on several topics in any order; it is taken when all of them have come as far,
or ``_PATIENCE`` has passed since (``instants``). Stamps are counted in control periods (``period_count``),
led by those of the encoders.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.drift.drift_watch import DriftWatch
from flexarm_estimator.drift.instants import Instants
from flexarm_estimator.drift.opinion_reader import OpinionReader
from flexarm_estimator.drift.period_count import THIN, PeriodCount
from flexarm_estimator.drift.settings import DriftConfig
from flexarm_estimator.messages.sensor_messages import SensorReader
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.conversions import NS_PER_S, ModelMessageError, model_from_msg, stamp_to_ns
from flexarm_model.manipulator.cameras import CAMERA
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.served.pending_models import PendingModels
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.same_arm import foreign_model
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
TIME_TOPIC = "joint_states"
TORQUE_TOPIC = "applied_effort"
STATE_TOPIC = "modal_state"
STATES = 0.1  # s between two states that are read: health changes no faster
PERCENT = 100.0
_PATIENCE = 0.5  # s
_MOST_WAITING = 1000  # torques
_HELD = 0.05  # s that a torque may be held; of an arm whose guard is silent nobody knows it: drives brake


class DriftExchange:
    """Owns the watch and translates.

    Attributes:
        watch: None until a model has been accepted.
        fault: Why there is none, or why the last model was refused; empty when all is well.
    """

    def __init__(
        self, config: ManipulatorConfig, estimator: EstimatorConfig, settings: DriftConfig | None = None
    ) -> None:
        """Start without a model."""
        self._config, self._settings = config, (estimator, settings or DriftConfig())
        self._reader, self._tree = SensorReader(config), ReducedTree(config)
        self._opinions = OpinionReader()
        self._patience = round(_PATIENCE * config.rate_hz)
        self._instants = Instants(self._patience)
        period_ns = round(NS_PER_S / config.rate_hz)
        self._time = PeriodCount(period_ns)
        led = {topic: PeriodCount(period_ns, self._time) for topic in self.topics}
        self._counts = led | {TIME_TOPIC: self._time}
        self._asked: set[str] = set()  # topics of sensors that the watch goes by
        self._torques: deque[tuple[int, Array]] = deque(maxlen=_MOST_WAITING)  # with the period before
        self._tau: Array = np.zeros(len(config.actuated))
        self._tau_from: int | None = None  # period at whose end it began
        self._pending: PendingModels[ReducedModel] = PendingModels()
        self.watch: DriftWatch | None = None
        self.fault = "no model yet"

    @property
    def topics(self) -> tuple[str, ...]:
        """Relative topics that ``on_sensor`` wants."""
        return (*(name for name in self._reader.topics if not name.startswith(f"{CAMERA}/")), TORQUE_TOPIC)

    @property
    def said_of_stamps(self) -> str:
        """Whose stamps leave too many periods without a sample; empty when nobody's do."""
        thin = sorted(topic for topic in self._asked if self._counts[topic].is_thin)
        lost = f"{PERCENT * THIN:g} % of the periods and more have no stamp"
        return f"{lost} on {', '.join(thin)}: stamps scatter, or messages are lost" if thin else ""

    @property
    def said_of_sensors(self) -> str:
        """The same, and which the watch goes on without or doubts."""
        said = self.said_of_stamps, "" if self.watch is None else self.watch.said_of_sensors
        return "; ".join(filter(None, said))

    def on_model(self, msg: Any) -> None:
        """Take a model of the same description, to be used from its stamp on; the first one at once."""
        try:
            model = model_from_msg(msg)
        except ModelMessageError as error:
            self.fault = f"model refused: {error}"
            return
        self.fault = foreign_model(model, self._config, "the drift watch")
        if self.fault:
            return
        if self.watch is not None:
            self._pending.add(stamp_to_ns(msg.header.stamp), model)
            return
        dt = 1.0 / self._config.rate_hz
        try:
            self.watch = DriftWatch(model, self._tree, self._config.sensors, self._settings, dt)
            self.watch.heed(self._opinions.opinion)
        except (KeyError, ValueError) as error:
            self.fault = f"model refused: {error}"

    def on_state(self, msg: Any) -> None:
        """Take what a state of the estimator says of the sensors; one every ``STATES`` seconds is enough."""
        self._heed(self._opinions.on_state, msg)

    def on_intervention(self, msg: Any) -> None:
        """Take what a user did to the estimator."""
        self._heed(self._opinions.on_intervention, msg)

    def on_sensor(self, topic: str, msg: Any) -> None:
        """Take a message of a sensor, or the torque that was applied; joint states move time on."""
        if self.watch is None:
            return
        period = self._counts[topic].count(stamp_to_ns(msg.header.stamp))
        if topic == TORQUE_TOPIC:
            self._on_torque(msg, period)
            return
        for sample in self._reader.read(topic, msg, 0.0).samples:
            self._instants.add(period, sample.sensor, sample.y)
            if sample.sensor in self.watch.sensors:
                self._asked.add(topic)
        if topic == TIME_TOPIC:
            awaited = (*self.watch.sensors, TORQUE_TOPIC)
            for due, samples in self._instants.due(awaited, period):
                self._take(due, samples)

    def _on_torque(self, msg: Any, period: int) -> None:
        tau, _ = self._reader.read_torque(TORQUE_TOPIC, msg)
        if tau is None:
            return
        if self._torques and period < self._torques[-1][0] - self._patience:
            self._torques.clear()  # the clock was set back: those would be waited for
        self._torques.append((period, tau))
        self._instants.hear(TORQUE_TOPIC, period)

    def _heed(self, read: Callable[[Any], None], msg: Any) -> None:
        before = self._opinions.opinion
        read(msg)
        if self.watch is not None and self._opinions.opinion is not before:
            self.watch.heed(self._opinions.opinion)

    def _take(self, period: int, samples: dict[str, Array]) -> None:
        assert self.watch is not None
        model = self._pending.due(self._time.stamp_ns(period))
        if model is not None:
            try:
                self.watch.adopt(model)
            except (KeyError, ValueError) as error:
                self.fault = f"model refused: {error}"
        while self._torques and self._torques[0][0] < period:
            self._tau_from, self._tau = self._torques.popleft()
        held = 0.0 if self._tau_from is None else (period - 0.5 - self._tau_from) / self._config.rate_hz
        self.watch.step(period, samples if held <= _HELD else {}, self._tau)
