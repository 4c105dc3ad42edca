"""The soak's own node: arms, moves, breaks sensors, and listens; it kills nobody itself.

Publishes
    reference (trajectory_msgs/JointTrajectory), rig/faults (std_msgs/String), stop (std_msgs/Empty).
Subscribes
    guard_status, controller_status, modal_state, end_effector, truth, /diagnostics, ~/ready of the nodes.
Calls
    guard/arm (std_srvs/Trigger).
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from flexarm_interfaces.msg import ControllerStatus, GuardStatus, ModalState, Truth
from nav_msgs.msg import Odometry
from numpy.typing import NDArray
from rclpy.node import Node
from rclpy.serialization import deserialize_message
from std_msgs.msg import Bool, Empty, String
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory

from flexarm_bringup.monitor.arrivals import Arrivals, newest_common
from flexarm_bringup.monitor.conversions import tip_of
from flexarm_bringup.processes.late_cycles import LateCycles
from flexarm_bringup.processes.spinning import MANY, spin_once
from flexarm_controller.conversions import reference_to_msg
from flexarm_controller.reference import Reference
from flexarm_model.conversions import NS_PER_S, verdict_from_msg
from flexarm_model.ros.node import LATCHED_QOS, LOCKSTEP_QOS, RELIABLE_QOS, SENSOR_QOS, events_executor
from flexarm_model.settings.diagnosis import Level

Array = NDArray[np.float64]

USABLE = (ModalState.OK, ModalState.DEGRADED)
STREAMS = {"modal_state": ModalState, "end_effector": Odometry, "truth": Truth}


class TipLook(NamedTuple):
    """Stamp [ns], error of the tip [m], whether the state may be used, and what the estimator says of it."""

    stamp_ns: int
    error: float
    is_usable: bool
    said: str


class SoakNode(Node):  # type: ignore[misc]
    """Speaks to a rig and keeps what is to be told of it.

    Attributes:
        ready: Whether each node is ready, by name.
        guard: Newest status.
        late: Its cycles, and those that were late.
        stops: Why it stopped, and how often.
        errors: Subjects of /diagnostics that became an error.
        answer: Newest word of the controller about a reference.
    """

    def __init__(self, names: Sequence[str]) -> None:
        """Connect; ``names`` are those of the nodes."""
        super().__init__("soak", namespace="flexarm", start_parameter_services=False)
        self.ready = dict.fromkeys(names, False)
        self.guard = GuardStatus()
        self.late = LateCycles()
        self.stops: Counter[str] = Counter()
        self.errors: Counter[str] = Counter()
        self.answer = ""
        self._bad: set[str] = set()
        self._arrivals = {topic: Arrivals(topic, True) for topic in STREAMS}
        self._executor = events_executor()
        self._executor.add_node(self)
        self._references = self.create_publisher(JointTrajectory, "reference", RELIABLE_QOS)
        self._faults = self.create_publisher(String, "rig/faults", RELIABLE_QOS)
        self._stop = self.create_publisher(Empty, "stop", RELIABLE_QOS)
        self._client = self.create_client(Trigger, "guard/arm")
        self._arming: Any = None
        self._listen()

    @property
    def is_armed(self) -> bool:
        """Whether commands pass."""
        return bool(self.guard.mode == GuardStatus.ARMED)

    @property
    def now_ns(self) -> int:
        """Newest stamp of the estimate [ns]; -1 before the first."""
        return max(self._arrivals["modal_state"].stamps(), default=-1)

    def spin(self, seconds: float) -> None:
        """Hear what comes within a while [s]."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0.0:
            spin_once(self._executor, left, MANY)

    def pose(self) -> Array | None:
        """Return the actuated axes of a usable estimate, (n_theta,); None without one."""
        raw = self._arrivals["modal_state"].newest
        state = None if raw is None else deserialize_message(raw, ModalState)
        usable = state is not None and state.status in USABLE
        return np.array(state.theta) if usable and state is not None else None

    def tip(self) -> TipLook | None:
        """Return the error of the newest estimate of the tip, and what the estimator said of it."""
        estimates, truths = self._arrivals["end_effector"], self._arrivals["truth"]
        stamp = newest_common(estimates, truths)
        raw = None if stamp is None else self._arrivals["modal_state"].at(stamp)
        if stamp is None or raw is None:
            return None
        pair = (
            deserialize_message(estimates.at(stamp) or b"", Odometry),
            deserialize_message(truths.at(stamp) or b"", Truth),
        )
        state, error = deserialize_message(raw, ModalState), tip_of(pair[0], pair, np.nan).error
        said = f"{state.age:.2f} s after its start: {state.reason or 'ok'}"
        return TipLook(stamp, float(error), state.status in USABLE, said) if np.isfinite(error) else None

    def try_to_arm(self) -> None:
        """Ask the guard, unless an answer is still to come."""
        is_waiting = self._arming is not None and not self._arming.done()
        if not is_waiting and self._client.service_is_ready():
            self._arming = self._client.call_async(Trigger.Request())

    def send(self, reference: Reference, names: Sequence[str], zero_ns: int) -> None:
        """Send a move whose time zero is a stamp [ns]."""
        self.answer = ""
        self._references.publish(reference_to_msg(reference, tuple(names), zero_ns))

    def break_sensor(self, text: str) -> None:
        """Give the rig's sensors a fault."""
        self._faults.publish(String(data=text))

    def on_ending(self, name: str) -> None:
        """Stop the motion, as every supervisor must when an essential process has ended."""
        self._stop.publish(Empty())
        self.ready[name] = False

    def close(self) -> None:
        """Leave the graph."""
        self._executor.shutdown()
        self.destroy_node()

    def _on_guard(self, msg: GuardStatus) -> None:
        if self.is_armed and msg.mode != GuardStatus.ARMED:
            self.stops[msg.reason.split(":")[0]] += 1
        self.guard = msg
        self.late.note(time.monotonic(), msg.late_ticks, msg.ticks)

    def _on_status(self, msg: ControllerStatus) -> None:
        if msg.reason.startswith("reference"):
            self.answer = msg.reason

    def _on_diagnostics(self, msg: DiagnosticArray) -> None:
        for verdict in map(verdict_from_msg, msg.status):
            if verdict.level != Level.ERROR:
                self._bad.discard(verdict.subject)
            elif verdict.subject not in self._bad:
                self._bad.add(verdict.subject)
                self.errors[verdict.subject] += 1

    def _on_ready(self, name: str, msg: Bool) -> None:
        self.ready[name] = msg.data

    def _listen(self) -> None:
        self.create_subscription(GuardStatus, "guard_status", self._on_guard, RELIABLE_QOS)
        self.create_subscription(ControllerStatus, "controller_status", self._on_status, LOCKSTEP_QOS)
        self.create_subscription(DiagnosticArray, "/diagnostics", self._on_diagnostics, RELIABLE_QOS)
        for topic, kind in STREAMS.items():
            keep = self._arrivals[topic].add
            self.create_subscription(
                kind, topic, lambda raw, keep=keep: keep(time.monotonic(), raw), SENSOR_QOS, raw=True
            )
        for name in self.ready:
            self.create_subscription(
                Bool, f"{name}/ready", lambda msg, name=name: self._on_ready(name, msg), LATCHED_QOS
            )


def start_of(node: SoakNode, lead: float) -> int:
    """Return the stamp that is so long after the newest one [ns]."""
    return node.now_ns + round(lead * NS_PER_S)
