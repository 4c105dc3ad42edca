"""Rig node: the simulated hardware, with the guard in front of its motors.

Publishes
    joint_states (sensor_msgs/JointState), strain (flexarm_interfaces/StrainArray), imu/<name>
        (sensor_msgs/Imu), camera/pose (geometry_msgs/PoseWithCovarianceStamped): the sensors.
    applied_effort (sensor_msgs/JointState): torque that acts from the stamp on.
    guard_status (flexarm_interfaces/GuardStatus): 10 Hz and on change.
    truth (flexarm_interfaces/Truth): what really happens; for reports only.
    tick (flexarm_interfaces/Tick): lockstep only, what was sent at this instant.
    /diagnostics (diagnostic_msgs/DiagnosticArray): 1 Hz while sensors have faults on request: which.
    ~/ready (std_msgs/Bool, latched).
Subscribes
    joint_commands (flexarm_interfaces/JointCommand), controller/margins (std_msgs/String, latched).
Services
    ~/arm, ~/stop (std_srvs/Trigger): let commands pass, unless the controller's margins are too small; stop.

In real time a timer advances the arm by the time that has passed, once a period. In lockstep it advances
by one period for every command, as soon as estimator and controller are ready and the guard is armed.
"""

from __future__ import annotations

import secrets
from dataclasses import dataclass

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from flexarm_interfaces.msg import JointCommand, Tick
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger

from flexarm_bringup.conversions import message_class
from flexarm_bringup.sim.conversions import (
    applied_effort_msg,
    command_from_msg,
    guard_status_msg,
    joint_state_msg,
    samples_to_msgs,
    truth_msg,
)
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim.sensor_fault_text import faults_text, parse_faults
from flexarm_bringup.sim.sensor_simulator import Sample
from flexarm_bringup.topics import streams
from flexarm_controller.guard import GuardCommand
from flexarm_controller.guard_settings import GuardSettings
from flexarm_model.config import load_config
from flexarm_model.conversions import ns_to_stamp, stamp_to_ns
from flexarm_model.manipulator_file import find_manipulator
from flexarm_model.node import (
    LATCHED_QOS,
    LOCKSTEP_QOS,
    RELIABLE_QOS,
    ReadyFlag,
    declare_configs,
    run_node,
)
from flexarm_model.parameters import parameter
from flexarm_model.start_pose import starting_at

DIAGNOSTICS_PERIOD = 1.0  # s
STATUS_PERIODS = 20  # motor periods between two guard_status messages
MOST_CATCH_UP = 20  # periods; after a longer stall the simulated arm skips time rather than race


@dataclass(frozen=True)
class RigNodeSettings:
    """Settings of the rig node beside those of the simulated hardware."""

    manipulator: str = parameter("single_link", "Name of a manipulator that comes along, or a YAML file.")
    preset: str = parameter("geared", "Preset of that file; empty for none.")
    start: tuple[float, ...] = parameter((), "Axes at the start; empty: home.", "rad or m")
    lockstep: bool = parameter(
        False, "Advance by messages instead of time: deterministic, faster than real time."
    )
    realtime_priority: int = parameter(
        0,
        "SCHED_FIFO priority while running, where the user may; 0 leaves it ordinary.",
        minimum=0,
        maximum=90,
    )
    partners: tuple[str, ...] = parameter(
        ("estimator", "controller"), "Nodes that must be ready before the first tick in lockstep."
    )
    faults: str = parameter("", "Faults of sensors: 'root_strain: off 1 3; camera: delayed 60 ms'.")


class RigNode(Node):
    """Hardware and guard, driven by a timer or by the commands."""

    SETTINGS = (RigNodeSettings, RigSettings, GuardSettings)

    def __init__(self) -> None:
        """Build the hardware at rest, with the guard stopped."""
        super().__init__("rig", namespace="flexarm")
        self.settings: RigNodeSettings
        self.settings, simulation, hardware = declare_configs(self)
        config = load_config(find_manipulator(self.settings.manipulator), self.settings.preset)
        self.config = starting_at(config, self.settings.start)
        faults = parse_faults(self.settings.faults, config.sensors)
        self.hardware = Hardware(self.config, simulation, hardware, faults=faults)
        self._steady = Clock(clock_type=ClockType.STEADY_TIME)
        self._period_ns = self.hardware.rig.period_ns
        self._epoch_ns = 0 if self.settings.lockstep else self.get_clock().now().nanoseconds
        self._started_ns = self._steady.now().nanoseconds
        self._command: GuardCommand | None = None
        self._ahead: list[Sample] | None = None  # in real time: of the tick that comes, not yet told
        self._sent: dict[str, int] = {}
        self._said = ("", "")
        self._is_running, self._margins, self._late_ticks = False, "", 0
        self._connect()

    def on_timer(self) -> None:
        """Advance by the periods that have passed."""
        elapsed_ns = self._steady.now().nanoseconds - self._started_ns
        passed = round(elapsed_ns / self._period_ns)  # nearest: a timer is never quite on time
        behind = passed - self.hardware.tick + (self._ahead is not None)
        self._late_ticks += max(behind - 1, 0)
        if behind > MOST_CATCH_UP:
            self.get_logger().warning(f"stalled for {behind} periods; the simulated arm skips them")
            self._started_ns += (behind - 1) * self._period_ns
            self._epoch_ns += (behind - 1) * self._period_ns
            behind = 1
        for _ in range(behind):
            self.advance()
            self._ahead = self.hardware.advance()  # while estimator and controller are at work

    def on_command(self, msg: JointCommand) -> None:
        """Keep the newest command; in lockstep the one of this tick moves time on."""
        command = command_from_msg(msg, self._epoch_ns)
        if not self.settings.lockstep:
            self._command = command
        elif self._is_running and stamp_to_ns(msg.header.stamp) == self.stamp_of(self.hardware.tick):
            self._command = command
            self.advance()

    def on_margins(self, msg: String) -> None:
        """Note why the controller's loop must not be closed; empty when it may."""
        self._margins = msg.data

    def on_ready(self, partner: str, msg: Bool) -> None:
        """Note that a partner is ready."""
        self._partners[partner] = msg.data
        self._start_when_possible()

    def on_arm(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Arm the guard with a new session token."""
        if self._margins:
            response.success, response.message = False, self._margins
            return response
        response.success = self.hardware.guard.arm(self.hardware.t, 1 + secrets.randbits(62))
        response.message = "armed" if response.success else f"still braking: {self.hardware.guard.reason}"
        self._say_guard()
        self._start_when_possible()
        return response

    def on_stop(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Latch a stop."""
        self.hardware.guard.stop("stopped by ~/stop")
        response.success, response.message = True, self.hardware.guard.reason or "was not armed"
        return response

    def on_diagnostics(self) -> None:
        """Tell which faults were asked for."""
        text = faults_text(self.hardware.rig.faults, self.config.sensors)
        status = DiagnosticStatus(name="rig: faults", level=DiagnosticStatus.WARN, message=text)
        array = DiagnosticArray(status=[status])
        array.header.stamp = self.get_clock().now().to_msg()
        self._diagnostics.publish(array)

    def advance(self) -> None:
        """Move the arm by one period and tell what its sensors say; then choose the next torque."""
        samples = self.hardware.advance() if self._ahead is None else self._ahead
        self._ahead = None
        self._publish_tick(samples)
        command, self._command = self._command, None
        tau = self.hardware.choose_torque(command)
        self._publish(
            "applied_effort", applied_effort_msg(self.hardware.names, tau, self.stamp_of(self.hardware.tick))
        )
        guard = self.hardware.guard
        if self.hardware.tick % STATUS_PERIODS == 0 or self._said != (guard.mode, guard.reason):
            self._say_guard()

    def stamp_of(self, tick: int) -> int:
        """Return the stamp of a tick [ns]."""
        return self._epoch_ns + tick * self._period_ns

    def _publish_tick(self, samples: list[Sample]) -> None:
        now_ns = self.stamp_of(self.hardware.tick)
        for out in samples_to_msgs(self.config, samples, self.stamp_of):
            self._publish(out.topic, out.msg)
        self._publish("joint_states", joint_state_msg(self.hardware, now_ns))
        self._publish("truth", truth_msg(self.config, self.hardware.rig.truth(), now_ns))
        if self.settings.lockstep:
            msg = Tick(sequence=self.hardware.tick, topics=list(self._sent), counts=list(self._sent.values()))
            msg.header.stamp = ns_to_stamp(now_ns)
            self._outlets["tick"].publish(msg)
            self._sent.clear()

    def _publish(self, topic: str, msg: object) -> None:
        self._outlets[topic].publish(msg)
        self._sent[topic] = self._sent.get(topic, 0) + 1

    def _say_guard(self) -> None:
        guard = self.hardware.guard
        if self._said != (guard.mode, guard.reason):
            self.get_logger().info(f"guard: {guard.mode}{': ' if guard.reason else ''}{guard.reason}")
        self._said = (guard.mode, guard.reason)
        self._publish(
            "guard_status", guard_status_msg(guard, self.stamp_of(self.hardware.tick), self._late_ticks)
        )

    def _start_when_possible(self) -> None:
        """Send tick 0 in lockstep once everybody listens and the guard is armed."""
        can_start = self.settings.lockstep and self.hardware.guard.token and all(self._partners.values())
        if can_start and not self._is_running:
            self._is_running = True
            self._publish_tick(self.hardware.observe())

    def _connect(self) -> None:
        accelerometers = [spec.name for spec in self.config.sensors if spec.kind == "accelerometer"]
        quality = LOCKSTEP_QOS if self.settings.lockstep else RELIABLE_QOS
        self._outlets = {
            stream.topic: self.create_publisher(message_class(stream.type), stream.topic, quality)
            for stream in streams(accelerometers)
            if stream.publisher == "rig"
        }
        self.create_subscription(JointCommand, "joint_commands", self.on_command, RELIABLE_QOS)
        self.create_subscription(String, "controller/margins", self.on_margins, LATCHED_QOS)
        self.create_service(Trigger, "~/arm", self.on_arm)
        self.create_service(Trigger, "~/stop", self.on_stop)
        self._partners = dict.fromkeys(self.settings.partners if self.settings.lockstep else (), False)
        for name in self._partners:
            self.create_subscription(
                Bool, f"{name}/ready", lambda msg, name=name: self.on_ready(name, msg), LATCHED_QOS
            )
        self._ready = ReadyFlag(self, {"hardware": lambda: True})
        if self.hardware.rig.faults:
            self._diagnostics = self.create_publisher(DiagnosticArray, "/diagnostics", RELIABLE_QOS)
            self.create_timer(DIAGNOSTICS_PERIOD, self.on_diagnostics, clock=self._steady)
            self.on_diagnostics()
        if not self.settings.lockstep:
            self.create_timer(self.hardware.dt, self.on_timer, clock=self._steady)


def main() -> int:
    """Run the node."""
    return run_node(RigNode)
