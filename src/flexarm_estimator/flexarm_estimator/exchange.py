"""The estimator between messages: what comes in, what goes out, no topics and no clock.

The node connects it to DDS, the replay to a bag; both therefore do the same.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.conversions import diagnostics_msg, state_to_msg, tip_to_msg
from flexarm_estimator.estimate import Estimate
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.parts import Parts
from flexarm_estimator.readings import Refusal
from flexarm_estimator.sensor_messages import SensorReader
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.conversions import NS_PER_S, ModelMessageError, model_from_msg, stamp_to_ns
from flexarm_model.description import ManipulatorConfig
from flexarm_model.pending_models import PendingModels
from flexarm_model.reduced_model import ReducedModel
from flexarm_model.reduced_tree import ReducedTree

Array = NDArray[np.float64]
TORQUE_TOPIC = "applied_effort"
_MOST_WAITING = 1000  # messages between two steps; a flood drops the oldest
_MOST_TORQUES = 200


@dataclass(frozen=True)
class Outgoing:
    """A message and the relative topic it goes to."""

    topic: str
    msg: Any


@dataclass(frozen=True)
class _Torque:
    """A torque that acts from ``stamp_ns`` on, (n_theta,)."""

    stamp_ns: int
    tau: Array


class EstimatorExchange:
    """Owns the estimator and translates.

    Attributes:
        estimator: None until a model has been accepted.
        estimate: The newest one; None before the first.
        model_fault: Why the last model was refused; empty when it was taken.
        notes: Count and newest reason of refusals that concern no sensor, by topic.
    """

    def __init__(self, config: ManipulatorConfig, settings: EstimatorConfig, epoch_ns: int | None) -> None:
        """Start without a model.

        Args:
            config: The manipulator.
            settings: Of the estimator.
            epoch_ns: Stamp that is time zero [ns]; None takes the first step's, and refuses stamps of zero.
        """
        self._config, self._settings = config, settings
        self._epoch_ns, self._is_live = epoch_ns, epoch_ns is None
        self._tree = ReducedTree(config)
        self._tree.tip_pose(self._tree.loops.home)  # compiles now, not in the first step
        self._reader = SensorReader(config)
        self._waiting: deque[tuple[str, Any]] = deque(maxlen=_MOST_WAITING)
        self._torques: deque[_Torque] = deque(maxlen=_MOST_TORQUES)
        self._tau = np.zeros(len(config.actuated))
        self._measured: Array | None = None
        self._is_told = False
        self._pending: PendingModels[Parts] = PendingModels()
        self._last_ns: int | None = None
        self.estimator: Estimator | None = None
        self.estimate: Estimate | None = None
        self.model_fault = "no model yet"
        self.notes: dict[str, tuple[int, str]] = {}

    @property
    def topics(self) -> tuple[str, ...]:
        """Relative topics that ``on_sensor`` wants."""
        return (*self._reader.topics, TORQUE_TOPIC)

    @property
    def receipt(self) -> str:
        """What models have been taken, in short; equal at all who took the same."""
        return self._pending.receipt

    def on_model(self, msg: Any) -> list[Outgoing]:
        """Take a model of the same description, to be used from its stamp on; refuse another by name.

        The first one is used at once; the others are prepared now and wait.
        """
        try:
            model = model_from_msg(msg)
        except ModelMessageError as error:
            self.model_fault = f"model refused: {error}"
            return []
        if model.config_id != self._config.config_id:
            self.model_fault = (
                f"model refused: model of '{model.manipulator}' has config {model.config_id}, "
                f"the estimator loaded {self._config.config_id} (preset '{self._config.preset}'): "
                "start both with the same file and preset"
            )
            return []
        self.model_fault = ""
        self._take(model, stamp_to_ns(msg.header.stamp))
        return []

    def on_sensor(self, topic: str, msg: Any) -> None:
        """Keep a message of a sensor, or the torque that was applied, for the next step."""
        self._waiting.append((topic, msg))

    def step(self, stamp_ns: int) -> list[Outgoing]:
        """Fuse what was taken and tell the state at a stamp [ns]; nothing without a model."""
        if self.estimator is None:
            self._waiting.clear()
            return []
        if self._is_live and stamp_ns <= 0:
            self._note("joint_states_timestamp", f"stamp is {stamp_ns} ns")
            return []
        if self._epoch_ns is None:
            self._epoch_ns = stamp_ns
        self._adopt_due(stamp_ns)
        samples = self._read_waiting()
        for torque in self._changes_before(stamp_ns):
            self.estimator.step([], self._tau, self._seconds(torque.stamp_ns))
            self._tau = torque.tau
        self.estimate = self.estimator.step(samples, self._tau, self._seconds(stamp_ns))
        self._last_ns = stamp_ns
        told_ns = round(self.estimate.t * NS_PER_S) + self._epoch_ns
        state = state_to_msg(self.estimate, self.estimator.model, told_ns)
        return [Outgoing("modal_state", state), Outgoing("end_effector", tip_to_msg(self.estimate, told_ns))]

    def reset(self) -> None:
        """Forget the state; the model stays."""
        self.estimate = None
        if self.estimator is not None:
            self.estimator.reset()

    def diagnostics(self, stamp_ns: int) -> Any:
        """Return the DiagnosticArray of now."""
        return diagnostics_msg(self.estimate, self.model_fault, self.notes, stamp_ns)

    def _take(self, model: ReducedModel, stamp_ns: int) -> None:
        try:
            if self.estimator is None:
                self.estimator = Estimator(model, self._tree, self._config.sensors, self._settings)
            else:
                self._pending.add(stamp_ns, self.estimator.prepare(model))
        except (KeyError, ValueError) as error:
            self.model_fault = f"model refused: {error}"
            return
        self._pending.note(stamp_ns, model.model_id)

    def _adopt_due(self, stamp_ns: int) -> None:
        """Go on with the model whose time has come."""
        assert self.estimator is not None
        parts = self._pending.due(stamp_ns)
        if parts is None or parts.model.model_id == self.estimator.model.model_id:
            return
        try:
            self.estimator.adopt(parts)
        except ValueError as error:  # axes of another arm under the same config_id
            self.model_fault = f"model refused: {error}"

    def _read_waiting(self) -> list[Measurement]:
        """Read all messages; count what cannot be used."""
        samples: list[Measurement] = []
        for topic, msg in self._waiting:
            stamp_ns = stamp_to_ns(msg.header.stamp)
            if stamp_ns < 0 or (self._is_live and stamp_ns == 0):
                self._note(f"{topic}_timestamp", f"stamp is {stamp_ns} ns")
            elif topic == TORQUE_TOPIC:
                self._take_torque(msg, stamp_ns)
            else:
                reading = self._reader.read(topic, msg, self._seconds(stamp_ns))
                samples += reading.samples
                self._refuse(reading.refusals)
                if topic == "joint_states" and len(msg.effort):
                    self._measured = self._reader.read_torque(topic, msg)[0]
        self._waiting.clear()
        return samples

    def _take_torque(self, msg: Any, stamp_ns: int) -> None:
        tau, refusals = self._reader.read_torque(TORQUE_TOPIC, msg)
        self._refuse(refusals)
        if tau is not None:
            self._torques.append(_Torque(stamp_ns, tau))

    def _changes_before(self, stamp_ns: int) -> Sequence[_Torque]:
        """Take the torques that began before ``stamp_ns``; return those that began since the last step."""
        begun = sorted((torque for torque in self._torques if torque.stamp_ns < stamp_ns), key=_began)
        self._torques = deque((t for t in self._torques if t.stamp_ns >= stamp_ns), maxlen=_MOST_TORQUES)
        self._is_told |= bool(begun)
        if not self._is_told and self._measured is not None:
            self._tau = self._measured  # no guard tells what it lets through: the drives' own torque
        older = [t for t in begun if self._last_ns is None or t.stamp_ns <= self._last_ns]
        self._tau = older[-1].tau if older else self._tau
        return begun[len(older) :]

    def _seconds(self, stamp_ns: int) -> float:
        return (stamp_ns - (self._epoch_ns or 0)) * 1e-9

    def _refuse(self, refusals: Sequence[Refusal]) -> None:
        names = {spec.name for spec in self._config.sensors}
        for refusal in refusals:
            if refusal.source in names and self.estimator is not None:
                self.estimator.refuse(refusal.source, refusal.reason)
            else:
                self._note(refusal.source, refusal.reason)

    def _note(self, source: str, reason: str) -> None:
        self.notes[source] = (self.notes.get(source, (0, ""))[0] + 1, reason)


def _began(torque: _Torque) -> int:
    return torque.stamp_ns
