"""The estimator node at the other end of DDS, for the rows of the fault matrix that are about messages."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from itertools import count
from pathlib import Path
from typing import Any

from flexarm_interfaces.msg import ReducedModel
from std_msgs.msg import String

from flexarm_bringup.fault_drill.message_stand import MessageStand, Recorded
from flexarm_bringup.fault_drill.stand import FAULT_START, Stand, Trace, trace_of
from flexarm_bringup.fault_drill.told_estimate import told_estimate
from flexarm_bringup.message_class import message_class
from flexarm_bringup.processes.graph import Process
from flexarm_bringup.processes.running_graph_node import Ear, running
from flexarm_bringup.topics import find_stream
from flexarm_estimator.estimate import Estimate
from flexarm_estimator.estimator_node import CLOSING_TOPIC
from flexarm_estimator.messages.inbox import Inbox
from flexarm_model.conversions import stamp_to_ns
from flexarm_model.ros.node import LATCHED_QOS, MODELS_QOS, RELIABLE_QOS

HEARD = ("modal_state", "end_effector", "/diagnostics")
PATIENCE = 20.0  # s for one answer
SETTLED = 0.2  # s after the answer to the newest message in which those before it are taken


class NodeLink:
    """Sends messages to an estimator node and hears what it says."""

    newest_only = (CLOSING_TOPIC,)

    def __init__(self, ear: Ear, topics: Sequence[str]) -> None:
        """Speak and hear through ``ear``, on ``topics`` from the beginning.

        A node may hear of a new publisher later than that one hears of it: the first message would be lost.
        """
        self._ear, self._publishers = ear, dict[str, Any]()
        self._receipts: list[str] = []
        self._models = ear.node.create_publisher(ReducedModel, "model", MODELS_QOS)
        ear.node.create_subscription(
            String, "estimator/models", lambda msg: self._receipts.append(msg.data), LATCHED_QOS
        )
        for topic in topics:
            self._publisher(topic)
        ear.wait(lambda: self._models.get_subscription_count() > 0, PATIENCE, "the estimator")

    def send_model(self, msg: Any) -> None:
        """Serve a model and wait until it has been taken."""
        known = set(self._receipts)
        self._models.publish(msg)
        self._ear.wait(lambda: bool(set(self._receipts) - known), PATIENCE, "a model to be taken")

    def send(self, topic: str, msg: Any) -> None:
        """Publish on a relative topic."""
        self._publisher(topic).publish(msg)

    def estimate(self, stamp_ns: int) -> Estimate:
        """Return what is said of an instant."""
        told: dict[str, Any] = {}

        def is_told() -> bool:
            """Say whether both topics have answered the instant."""
            for topic in HEARD[:2]:
                newest = self._ear.latest(topic)
                if newest is not None and stamp_to_ns(newest.header.stamp) == stamp_ns:
                    told[topic] = newest
            return len(told) == 2

        self._ear.wait(is_told, PATIENCE, f"the estimate of {stamp_ns}")
        return told_estimate(told["modal_state"], told["end_effector"], 1e-9 * stamp_ns)

    def diagnostics(self, stamp_ns: int) -> Any:
        """Return the diagnostics of now: made when all that was sent has been taken."""
        self._ear.listen(SETTLED)
        heard, since = self._ear.heard["/diagnostics"], time.time_ns()
        self._ear.wait(
            lambda: bool(heard) and stamp_to_ns(heard[-1].header.stamp) > since, PATIENCE, "diagnostics"
        )
        return heard[-1]

    def _publisher(self, topic: str) -> Any:
        if topic not in self._publishers:
            stream = find_stream(f"/flexarm/{topic}")
            if stream is None:
                raise KeyError(topic)
            made = self._ear.node.create_publisher(message_class(stream.type), topic, RELIABLE_QOS)
            self._ear.wait(lambda: made.get_subscription_count() > 0, PATIENCE, f"a listener on {topic}")
            self._publishers[topic] = made
        return self._publishers[topic]


class LiveStand:
    """A stand whose estimator is a node; every run starts a new one."""

    def __init__(self, stand: Stand, folder: Path) -> None:
        """Use the record of ``stand``; logs go to ``folder``."""
        self._stand, self._folder = stand, folder
        self._runs, self._stack = count(), ExitStack()
        self.record, self.dt, self.nominal, self.of_kind = (
            stand.record,
            stand.dt,
            stand.nominal,
            stand.of_kind,
        )

    def __enter__(self) -> LiveStand:
        """Return the stand itself."""
        return self

    def __exit__(self, *error: object) -> None:
        """Stop the node."""
        self._stack.close()

    @property
    def messages(self) -> MessageStand:
        """What sends messages, here to the node."""
        return MessageStand(self._stand, self._start)

    def play(self, clock: Callable[[float], float]) -> Trace:
        """Run with all clocks changed."""
        told = self.messages.play(lambda tick, messages: messages, FAULT_START, clock)
        return trace_of(self.record.t, self.record.tip, told.estimates, {})

    def _start(self, stand: Recorded) -> NodeLink:
        self._stack.close()
        config = stand.arm.config
        parameters = {
            "manipulator": stand.arm.task.manipulator,
            "preset": config.preset,
            **stand.arm.task.settings.get("estimator", {}),
        }
        node = Process("flexarm_estimator", "estimator_node", "estimator", parameters)
        _, ear = self._stack.enter_context(running((node,), HEARD, self._folder / str(next(self._runs))))
        return NodeLink(ear, Inbox(config, is_live=True).topics)
