"""Recorder node: writes every stream of the table into a bag, as received, without decoding it.

Subscribes
    All topics of flexarm_bringup.topics.
Publishes
    /diagnostics (diagnostic_msgs/DiagnosticArray): 1 Hz; an error as soon as the disk refuses.
    ~/ready (std_msgs/Bool, latched): true once nothing that the partners send can be missed any more.

By the clock, what is offered best effort is heard best effort (``offered_node``). The bag is closed on SIGINT
and SIGTERM; the last words name the topics of its partners on which nothing came. Log times are those of
arrival, or of the ticks in lockstep. When the disk refuses, the node goes on without writing, for the arm may
be moving, and its exit code will be 1.

That a publisher is known here does not mean that it knows this subscriber yet. The proof is its latched
``<partner>/ready``, subscribed to last: it arrives when the partner has matched that subscription, and
DDS announces the subscriptions of a process in the order in which they were made.
"""

from __future__ import annotations

import os

os.environ.setdefault("OMP_NUM_THREADS", "1")

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Bool

from flexarm_bringup.bags.bag_writer import BagError, BagWriter
from flexarm_bringup.bags.cdr import has_stamp, header_stamp_ns
from flexarm_bringup.bags.described_arm import files_to_keep
from flexarm_bringup.bags.log_order import ArrivalLog, LockstepLog
from flexarm_bringup.bags.unheard import unheard
from flexarm_bringup.conversions import deserialise
from flexarm_bringup.message_class import message_class
from flexarm_bringup.offered_node import AsOffered
from flexarm_bringup.provenance import provenance
from flexarm_bringup.topics import Stream, streams
from flexarm_estimator.messages.inbox import TORQUE_TOPIC
from flexarm_estimator.messages.sensor_messages import SensorReader
from flexarm_model.manipulator.cameras import cameras
from flexarm_model.manipulator.imu import imus
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.ros.declared_node import declare_configs, load_arm, told_by
from flexarm_model.ros.managed_node import LifeSettings, ManagedNode
from flexarm_model.ros.node import LATCHED_QOS, RELIABLE_QOS, run_node
from flexarm_model.settings.arm_settings import ArmSettings
from flexarm_model.settings.parameters import ParameterError, parameter

DEPTH = 5000  # messages that may wait for the disk: a second of everything in lockstep
DIAGNOSTICS_PERIOD = 1.0  # s
FLUSH_PERIOD = 0.5  # s; so old may be at most what a full disk costs
LOGS: dict[bool, type[ArrivalLog] | type[LockstepLog]] = {False: ArrivalLog, True: LockstepLog}


@dataclass(frozen=True)
class RecorderSettings(ArmSettings):
    """Settings of the recorder node."""

    bag: str = parameter("", "Folder to create.")
    lockstep: bool = parameter(False, "Log at the stamps of the ticks instead of the times of arrival.")
    partners: tuple[str, ...] = parameter(
        ("model", "rig", "guard", "estimator", "controller"), "Nodes whose first message must not be missed."
    )
    debug: bool = parameter(False, "Record controller_debug, too; the controller sends it to who listens.")
    settings: str = parameter(
        "{}", "Parameters of the other nodes that are not defaults, as JSON; kept in the bag."
    )


class RecorderNode(ManagedNode):
    """Receives serialised messages and hands them to the log.

    Attributes:
        failure: Why nothing is written any more; empty while all is well.
        exit_code: Of the process: 1 after a failure.
    """

    SETTINGS = (RecorderSettings, LifeSettings)

    def __init__(self) -> None:
        """Read what the machine has to say."""
        super().__init__("recorder")
        settings: RecorderSettings
        settings, life = declare_configs(self)
        config = load_arm(self, settings.manipulator, settings.preset)
        wanted = {"tick": settings.lockstep, "controller_debug": settings.debug}
        wanted |= dict.fromkeys(("feedback_gains", "predicted"), False)  # they follow from the others
        table = streams(imus(config.sensors), cameras(config.sensors))
        self._streams = [stream for stream in table if wanted.get(stream.topic, True)]
        self._measured = (*SensorReader(config).topics, TORQUE_TOPIC)
        self._settings, self.failure, self._lost, self.exit_code = settings, "", 0, 0
        self.start(life)

    def configure(self) -> None:
        """Create the bag."""
        settings = self._settings
        path = find_manipulator(settings.manipulator)
        about = provenance(path.stem, path, settings.preset, settings.settings)
        try:
            self._bag = BagWriter(Path(settings.bag), self._streams, about, files=files_to_keep(path))
        except BagError as error:
            with told_by(self, "bag"):
                raise ParameterError(f"bag: {error}") from error

    def activate(self) -> None:
        """Subscribe to everything."""
        self._log = LOGS[self._settings.lockstep](self._streams, self._write)
        self._connect(self._settings.partners)

    def deactivate(self) -> None:
        """Write what waits; where that fails the bag is closed all the same."""
        try:
            missing = self._log.close()  # what it writes now may be lost, too
        except Exception:
            self.exit_code = 1
            self._bag.close()
            raise
        self._lost += missing

    def release(self) -> None:
        """Close the bag, say what became of it."""
        try:
            self._bag.close()
        except OSError as error:
            if not self.failure:
                self._note(error)  # its topics are gone by now
        count, path = sum(self._bag.counts.values()), self._bag.path
        if self.failure:  # what waited for the disk then is in the count, and not all of it may be there
            self.get_logger().error(
                f"at most {count} messages in {path}, {self._lost} lost: {self.failure}; "
                "what is whole of it: flexarm recover"
            )
        else:
            silent = unheard(self._streams, self._bag.counts, self._settings.partners, self._measured)
            remark = f"; nothing came on {', '.join(silent)}" if silent else ""
            logger = self.get_logger()
            level = logger.error if self._lost else logger.warning if silent else logger.info
            level(f"{count} messages in {path}, {self._lost} lost{remark}")

    def on_message(self, stream: Stream, cdr: bytes) -> None:
        """Log a message; a tick also tells what belongs to its instant. One cut short is lost."""
        if stream.is_stamped and not has_stamp(cdr):
            self._lost += 1
            return
        stamp_ns = header_stamp_ns(cdr) if stream.is_stamped else None
        try:
            tick = deserialise(cdr, stream.type) if stream.topic == "tick" else None
        except rclpy_implementation.RMWError:
            self._lost += 1
            return
        self._log.add(stream, cdr, stamp_ns, time.time_ns())
        if tick is not None:
            self._log.announce(tick.sequence, header_stamp_ns(cdr), tick.topics, tick.counts)

    def on_flush(self) -> None:
        """Hand what waits to the disk, so that a full one shows; in lockstep no clock has a say in files."""
        if self._settings.lockstep or self.failure:
            return
        try:
            self._bag.flush()
        except OSError as error:
            self._fail(error)

    def on_diagnostics(self) -> None:
        """Say how much was written, or why nothing more is."""
        name = f"{self.get_namespace().strip('/')}/recorder"
        status = DiagnosticStatus(name=name, hardware_id=str(self._bag.path))
        status.level = DiagnosticStatus.ERROR if self.failure else DiagnosticStatus.OK
        status.message = self.failure or "recording"
        status.values = [KeyValue(key=name, value=str(n)) for name, n in self._bag.counts.items() if n]
        array = DiagnosticArray(status=[status])
        array.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(array)

    def _connect(self, partners: Sequence[str]) -> None:
        offered = AsOffered(self)
        subscribe = (
            partial(self.create_subscription, raw=True) if self._settings.lockstep else offered.subscribe
        )
        for stream in self._streams:
            durability = DurabilityPolicy.TRANSIENT_LOCAL if stream.is_latched else DurabilityPolicy.VOLATILE
            qos = QoSProfile(depth=DEPTH, durability=durability)
            subscribe(message_class(stream.type), stream.topic, self._receiver(stream), qos)
        self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", RELIABLE_QOS)
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(DIAGNOSTICS_PERIOD, self.on_diagnostics, clock=steady)
        self.create_timer(FLUSH_PERIOD, self.on_flush, clock=steady)
        self._heard: set[str] = set()
        for name in partners:  # last, see the module
            self.create_subscription(Bool, f"{name}/ready", self._hearer(name), LATCHED_QOS)
        heard = {name: partial(self._heard.__contains__, name) for name in partners}
        self.tell_ready({**heard, "topics": offered.has_all})

    def _receiver(self, stream: Stream) -> Callable[[bytes], None]:
        def on_raw(cdr: bytes) -> None:  # a callable with two arguments would be given more than the message
            """Log a message."""
            self.on_message(stream, cdr)

        return on_raw

    def _hearer(self, name: str) -> Callable[[Bool], None]:
        return lambda _: self._heard.add(name)

    def _write(self, name: str, log_time_ns: int, cdr: bytes) -> None:
        if self.failure:
            self._lost += 1
            return
        try:
            self._bag.write(name, log_time_ns, cdr)
        except OSError as error:
            self._lost += 1
            self._fail(error)

    def _fail(self, error: OSError) -> None:
        if not self.failure:
            self._note(error)
            self.on_diagnostics()

    def _note(self, error: OSError) -> None:
        self.failure, self.exit_code = f"recording ended: {error}", 1
        self.get_logger().error(self.failure)


def main() -> int:
    """Run the node."""
    return run_node(RecorderNode)
