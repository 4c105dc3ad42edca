"""Monitor node: listens to everything a rig says, as bytes, and makes a picture of it when asked.

Subscribes
    every topic of the table (``topics``) that somebody publishes, best effort, so that no publisher ever
    waits for it; not ``controller_debug`` and ``feedback_gains``, which the controller makes for listeners.
    /diagnostics of all nodes.

Messages are kept as bytes; only the newest of each topic are read, once per picture. Listening to a rig at
200 Hz takes a few percent of a core.
"""

from __future__ import annotations

import time
from dataclasses import replace
from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from flexarm_interfaces.msg import ReducedModel as ReducedModelMsg
from rclpy.node import Node
from rclpy.serialization import deserialize_message

from flexarm_bringup.conversions import deserialise
from flexarm_bringup.described import described, foreign_description
from flexarm_bringup.message_class import message_class
from flexarm_bringup.monitor.arrivals import Arrivals, newest_common
from flexarm_bringup.monitor.conversions import (
    axes_of,
    controller_from_msg,
    estimate_from_msg,
    guard_from_msg,
    modes_of,
    sensors_from_msg,
    tip_of,
)
from flexarm_bringup.monitor.model_book import ModelBook
from flexarm_bringup.monitor.picture import SILENT, UNKNOWN, Picture, TipRow
from flexarm_bringup.processes.spinning import MANY, spin_once
from flexarm_bringup.topics import NAMESPACE, find_stream
from flexarm_model.conversions import model_from_msg, verdict_from_msg
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.ros.node import MODELS_QOS, RELIABLE_QOS, SENSOR_QOS, events_executor
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.settings.diagnosis import Level, Verdict

LOOK_PERIOD = 1.0  # s between two looks for new topics
QUIET = 5.0  # s after which what a node said of its health is told as old
FORGET = 60.0  # s after which it is dropped
UNWATCHED = frozenset(
    {"controller_debug", "feedback_gains", "model", "/diagnostics", "robot_description", "tick"}
)


class MonitorNode(Node):  # type: ignore[misc]
    """Listens to one rig."""

    def __init__(self, manipulator: str = "") -> None:
        """Listen; ``manipulator`` is the file of the description where it does not come along."""
        super().__init__("monitor", namespace="flexarm", start_parameter_services=False)
        self._manipulator = manipulator
        self._arrivals: dict[str, Arrivals] = {}
        self._models = ModelBook(lambda raw: model_from_msg(deserialize_message(raw, ReducedModelMsg)))
        self._config: tuple[str, ManipulatorConfig | None, str] = ("", None, "")
        self._verdicts: dict[str, tuple[float, Verdict]] = {}
        self._largest: dict[str, float] = {}
        self._looked = -LOOK_PERIOD
        self._executor = events_executor()
        self._executor.add_node(self)
        self.create_subscription(ReducedModelMsg, "model", self._models.add, MODELS_QOS, raw=True)
        self.create_subscription(DiagnosticArray, "/diagnostics", self.on_diagnostics, RELIABLE_QOS)

    def listen(self, seconds: float) -> None:
        """Listen for a while [s]."""
        end = time.monotonic() + seconds
        while (now := time.monotonic()) < end:
            if now - self._looked >= LOOK_PERIOD:
                self._looked = now
                self._look()
            spin_once(self._executor, end - now, MANY)

    def on_diagnostics(self, msg: DiagnosticArray) -> None:
        """Keep the newest verdict of every subject."""
        now = time.monotonic()
        self._verdicts |= {status.name: (now, verdict_from_msg(status)) for status in msg.status}

    def picture(self) -> Picture:
        """Return what is known now."""
        now = time.monotonic()
        state, status, guard = (
            self._newest(name) for name in ("modal_state", "controller_status", "guard_status")
        )
        model = self._models.find(state.model_id if state is not None else "")
        known: dict[str, Any] = {"domain": str(self.context.get_domain_id())}
        if model is not None:
            config, known["foreign"] = self._description(model)
            known["model_id"] = model.model_id
            known["title"] = f"{model.manipulator} {config.preset if config else ''}".strip()
            now_told = state if self._is_recent("modal_state", now) else None
            known["modes"] = modes_of(model, now_told, self._largest)
            self._note_largest(known["modes"])
            led = status if self._is_recent("controller_status", now) else None
            effort = self._newest("applied_effort") if self._is_recent("applied_effort", now) else None
            known["axes"] = axes_of(
                model, now_told, effort, config, () if led is None else led.tracking_error
            )
        if state is not None:
            sensors = sensors_from_msg(state) if self._is_recent("modal_state", now) else ()
            known |= {"estimate": estimate_from_msg(state), "sensors": sensors}
        if guard is not None:
            known["guard"] = guard_from_msg(guard, self._arrivals["guard_status"].row(now).age)
        if status is not None:
            known["controller"] = controller_from_msg(status)
        verdicts = tuple(
            _aged(verdict, now - t) for t, verdict in self._verdicts.values() if now - t < FORGET
        )
        topics = tuple(self._arrivals[name].row(now) for name in sorted(self._arrivals))
        return Picture(tip=self._tip(now), topics=topics, verdicts=verdicts, **known)

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self.destroy_node()

    def _look(self) -> None:
        """Subscribe to what has appeared."""
        for name, _ in self.get_topic_names_and_types():
            stream = find_stream(name)
            if stream is None or stream.topic in UNWATCHED or stream.topic in self._arrivals:
                continue
            if self.count_publishers(name):
                arrivals = self._arrivals[stream.topic] = Arrivals(stream.topic, stream.is_stamped)
                self.create_subscription(
                    message_class(stream.type), name, partial(_note, arrivals), SENSOR_QOS, raw=True
                )

    def _newest(self, topic: str) -> Any | None:
        arrivals = self._arrivals.get(topic)
        return None if arrivals is None or arrivals.newest is None else _read(topic, arrivals.newest)

    def _is_recent(self, topic: str, now: float) -> bool:
        arrivals = self._arrivals.get(topic)
        return arrivals is not None and not arrivals.row(now).age > SILENT

    def _tip(self, now: float) -> TipRow | None:
        told = self._newest("end_effector") if self._is_recent("end_effector", now) else None
        if told is None:
            return None
        goal = self._newest("motion_status")
        estimates, truths = self._arrivals["end_effector"], self._arrivals.get("truth")
        stamp = newest_common(estimates, truths) if truths is not None else None
        pair = None
        if truths is not None and stamp is not None:
            raws = estimates.at(stamp), truths.at(stamp)
            pair = _read("end_effector", raws[0] or b""), _read("truth", raws[1] or b"")
        return tip_of(told, pair, goal.distance if goal is not None else UNKNOWN)

    def _description(self, model: ReducedModel) -> tuple[ManipulatorConfig | None, str]:
        """Return the description of a model, if it is known, and that the one named is of another arm."""
        if self._config[0] != model.config_id:
            config = described(self._manipulator or model.manipulator, model.config_id)
            foreign = foreign_description(self._manipulator, model) if self._manipulator else ""
            self._config = model.config_id, config, foreign
        return self._config[1:]

    def _note_largest(self, modes: Any) -> None:
        for row in modes:
            if abs(row.at_tip) > self._largest.get(row.name, 0.0):
                self._largest[row.name] = abs(row.at_tip)


def _aged(verdict: Verdict, age: float) -> Verdict:
    """Return a verdict, or that nobody says it any more."""
    if age < QUIET:
        return verdict
    return replace(verdict, level=Level.STALE, text=f"said nothing for {age:.0f} s; last: {verdict.text}")


def _note(arrivals: Arrivals, raw: bytes) -> None:
    arrivals.add(time.monotonic(), raw)


def _read(topic: str, raw: bytes) -> Any:
    stream = find_stream(f"{NAMESPACE}/{topic}")
    assert stream is not None
    return deserialise(raw, stream.type)
