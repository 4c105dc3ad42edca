"""The graph by the clock, watched as ``flexarm rig`` watches it, with the time at which each message came.

It hears ``TOPICS`` and sends references; see ``watch_node`` for what stops the arm when a process ends.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial

import numpy as np
from numpy.typing import NDArray
from rclpy.serialization import deserialize_message
from std_msgs.msg import Float64, String
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory

from flexarm_bringup.fault_drill.heard import Arrival, Heard
from flexarm_bringup.fault_drill.system_stand import SystemStand
from flexarm_bringup.message_class import message_class
from flexarm_bringup.processes.graph import Process
from flexarm_bringup.processes.running_graph_node import DEEP_QOS, Ear, running
from flexarm_bringup.processes.supervisor import Supervisor
from flexarm_bringup.rig_run.watch_node import WatchNode
from flexarm_bringup.topics import NAMESPACE, find_stream
from flexarm_controller.conversions import reference_to_msg
from flexarm_controller.reference import hold
from flexarm_model.conversions import stamp_to_ns
from flexarm_model.ros.node import MODELS_QOS, RELIABLE_QOS

Array = NDArray[np.float64]
TOPICS = (
    "model", "joint_states", "drive_states", "modal_state", "end_effector", "controller_status",
    "joint_commands", "applied_effort", "guard_status", "truth",
)  # fmt: skip
LOOK_PERIOD = 0.005  # s
ASK_PERIOD, RECENT = 1.0, 0.1  # s
BEHIND = 1_000_000_000  # ns, by which a listener may be behind; a clock that jumped is farther off
PATIENCE = 120.0  # s for what takes a few seconds on a machine that nobody else uses


class LiveRig:
    """A running graph whose processes may be hit.

    Attributes:
        stand: The machine.
        ear: Hears and calls.
        came: Arrivals by topic, in order.
        respawned: When each node was started again, the last time, by ``time.time``.
        has_reserves: All are ready, and so is a reserve of each.
    """

    def __init__(self, stand: SystemStand, supervisor: Supervisor, ear: Ear) -> None:
        """Begin to hear."""
        self.stand, self.ear, self._supervisor = stand, ear, supervisor
        self._watch = WatchNode(supervisor.nodes, lambda text: None)
        self.came: dict[str, Heard] = {}
        for topic in TOPICS:
            stream = find_stream(f"{NAMESPACE}/{topic}")
            if stream is None:
                raise KeyError(topic)
            kind, qos = message_class(stream.type), MODELS_QOS if stream.is_latched else DEEP_QOS
            self.came[topic] = heard = Heard(partial(deserialize_message, message_type=kind))
            ear.node.create_subscription(kind, topic, _noting(heard), qos, raw=True)
        self.respawned: dict[str, float] = {}
        self.has_reserves = False
        self._references = ear.node.create_publisher(JointTrajectory, "reference", 10)
        self._faults = ear.node.create_publisher(String, "rig/faults", RELIABLE_QOS)
        self._jumps = ear.node.create_publisher(Float64, "rig/clock_jump", RELIABLE_QOS)
        self._goals = swings(stand)
        self._arm = ear.node.create_client(Trigger, "guard/arm")
        self._ask_at = 0.0

    def pid(self, name: str) -> int:
        """Return the process number of a node."""
        return self._supervisor.pids[name]

    def listen(self, seconds: float) -> None:
        """Hear, and tend the processes, for a while."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            self._look()

    def wait(self, condition: Callable[[], bool], what: str) -> None:
        """Hear, and tend the processes, until something holds."""

        def holds() -> bool:
            """Look around, then ask."""
            self._look()
            return condition()

        self.ear.wait(holds, PATIENCE, what)

    def arm(self) -> None:
        """Wait until all are ready, and ask the guard to be armed until commands pass."""
        self.wait(lambda: self._watch.all_ready, "all to be ready")
        self.wait(self._is_under_control, "commands to pass")

    def swing(self) -> None:
        """Send the arm to its other place; it is led there at its velocity limit."""
        newest, now = stamp_to_ns(self.came["joint_states"][-1][1].header.stamp), time.time_ns()
        if abs(now - newest) < BEHIND:  # it may have waited here, and a reference must not begin long ago
            newest = now
        names = tuple(self.stand.stand.arm.config.actuated)
        msg = reference_to_msg(hold(next(self._goals)), names, newest)
        self._references.publish(msg)

    def tell_faults(self, text: str) -> None:
        """Give the rig's sensors faults from now on, as its topic ``faults`` has them."""
        self._faults.publish(String(data=text))

    def jump_clock(self, by: float) -> None:
        """Let all stamps of the rig be so many seconds later from now on."""
        self._jumps.publish(Float64(data=by))

    def after(self, topic: str, since: float) -> list[Arrival]:
        """Return what came on a topic after a time."""
        return self.came[topic].after(since)

    def forget(self) -> None:
        """Drop what has come so far."""
        for arrivals in self.came.values():
            arrivals.clear()

    def stop_motion(self, process: Process) -> None:
        """Stop the arm because a process has ended; may be called from any thread."""
        self._watch.stop_motion(process)

    def end(self) -> None:
        """Leave the graph."""
        self._watch.end()

    def _look(self) -> None:
        self.ear.listen(LOOK_PERIOD)
        self._watch.spin(0.0)
        self.has_reserves = self._watch.all_ready and self._supervisor.provide()
        for ending in self._supervisor.tend():
            self.respawned[ending.process.name] = time.time()
            self._watch.on_ending(ending.process)

    def _is_under_control(self) -> bool:
        """Tell whether commands come and the guard is armed; ask it if not: it may not have heard us."""
        told = self.came["guard_status"]
        is_armed = bool(told) and told[-1][1].mode == told[-1][1].ARMED
        now = time.monotonic()
        if not is_armed and self._arm.service_is_ready() and now >= self._ask_at:
            self._arm.call_async(Trigger.Request())
            self._ask_at = now + ASK_PERIOD
        return is_armed and self.came["joint_commands"].came_after(time.time() - RECENT)


def _noting(heard: Heard) -> Callable[[bytes], None]:
    return lambda raw: heard.add(time.time(), raw)


@contextmanager
def live_rig(stand: SystemStand) -> Iterator[LiveRig]:
    """Run the graph of a machine in a domain of its own, all of it ready."""
    with running(stand.graph(), (), stand.folder()) as (supervisor, ear):
        rig = LiveRig(stand, supervisor, ear)
        try:
            with supervisor.telling(rig.stop_motion):
                yield rig
        finally:
            rig.end()


def swings(stand: SystemStand) -> Iterator[Array]:
    """Yield in turn the place of the machine's tour that is farthest from its start, and the start."""
    theta = stand.stand.arm.course.reference.theta
    far = theta[np.argmax(np.linalg.norm(theta - theta[0], axis=1))]
    while True:
        yield far
        yield theta[0]
