"""Rig node: the simulated hardware, drives and sensors. What it obeys is the guard alone.

Publishes
    drive_states (sensor_msgs/JointState): what the drives measure for themselves, once a motor period.
    joint_states (sensor_msgs/JointState), strain (flexarm_interfaces/StrainArray), imu/<name>
        (sensor_msgs/Imu), camera/pose (geometry_msgs/PoseWithCovarianceStamped): the sensors.
    truth (flexarm_interfaces/Truth): what really happens; for reports only.
    tick (flexarm_interfaces/Tick): lockstep only, what was sent at this instant.
    /diagnostics (diagnostic_msgs/DiagnosticArray): see ``rig_health_node``.
    ~/attached (std_msgs/String, latched): see ``drive_side_node``.
    ~/ready (std_msgs/Bool, latched).
Subscribes
    applied_effort (sensor_msgs/JointState): torque from the stamp on, sealed by the guard.
    ~/faults (std_msgs/String), ~/clock_jump (std_msgs/Float64): see ``rig_health_node``.
Services
    ~/attach (std_srvs/Trigger): see ``drive_side_node``.

In real time an alarm advances the arm by the time that has passed, once a period; the newest torque acts for
a period, and without one the drives' watchdog brakes, and closes the brakes. In lockstep the arm advances by
one period for every torque, from the first one on and as soon as everybody is ready.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import partial

from sensor_msgs.msg import JointState
from std_msgs.msg import Bool

from flexarm_bringup.drive_side_node import DriveSide
from flexarm_bringup.rig_health_node import RigHealth
from flexarm_bringup.rig_voice_node import RigVoice
from flexarm_bringup.sim.drives import Drives, drive_limits
from flexarm_bringup.sim.plant import Plant
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim.sample import Sample
from flexarm_bringup.sim.sensor_fault_text import parse_faults
from flexarm_model.conversions import LAST_STAMP_NS, NS_PER_S, stamp_to_ns
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.start_pose import starting_at
from flexarm_model.process.ahead import made
from flexarm_model.ros.alarm import Alarm
from flexarm_model.ros.bytes_node import subscribe_bytes
from flexarm_model.ros.declared_node import declare_configs, load_arm, told_by
from flexarm_model.ros.managed_node import LifeSettings, ManagedNode
from flexarm_model.ros.node import (
    LATCHED_QOS,
    LOCKSTEP_QOS,
    NEWEST_QOS,
    run_node,
)
from flexarm_model.settings.arm_settings import LoopSettings
from flexarm_model.settings.diagnosis import DiagnosticsConfig
from flexarm_model.settings.parameters import parameter

MOST_CATCH_UP = 8  # periods, less than the silence that drives bear; after a longer stall the arm skips time
LONGEST_STAND = 2.0  # s in which an arm that the drives brake comes to rest; nobody is asked meanwhile
PATIENCE = 0.6  # of a period; after it the next tick is made ready although no torque has come


@dataclass(frozen=True)
class RigNodeSettings(LoopSettings):
    """Settings of the rig node beside those of the simulated hardware."""

    start: tuple[float, ...] = parameter((), "Axes at the start; empty: home.", "rad or m")
    lockstep: bool = parameter(
        False, "Advance by messages instead of time: deterministic, faster than real time."
    )
    partners: tuple[str, ...] = parameter(
        ("estimator", "controller", "guard"), "Nodes that must be ready before the first tick in lockstep."
    )
    silence: float = parameter(0.05, "Silence of the guard after which the drives let go.", "s", 0.01, 1.0)
    brake_time: float = parameter(
        0.1, "Damping after which drives that have let go close their brakes at the latest.", "s", 0.0, 10.0
    )
    faults: str = parameter("", "Faults of sensors: 'root_strain: off 1 3; camera: delayed 60 ms'.")


class RigNode(ManagedNode):
    """Hardware, driven by an alarm or by the guard."""

    SETTINGS = (RigNodeSettings, RigSettings, DiagnosticsConfig, LifeSettings)

    def __init__(self) -> None:
        """Read the description and the faults that are wanted."""
        super().__init__("rig")
        self.settings: RigNodeSettings
        self._simulation: RigSettings
        self.settings, self._simulation, self._thresholds, life = declare_configs(self)
        config = load_arm(self, self.settings.manipulator, self.settings.preset)
        with told_by(self, "start", "faults"):
            self.config = starting_at(config, self.settings.start)
            self._faults = parse_faults(self.settings.faults, config.sensors)
        self.alarm = Alarm(self.on_alarm, time.monotonic)
        self.start(life)

    def activate(self) -> None:
        """Build the hardware at rest."""
        plant = made(_plant_of, self.config, self._simulation)
        self.drives = Drives(self.config, self._simulation, plant, self._faults)
        silence, brake_time = self.settings.silence, self.settings.brake_time
        limits = drive_limits(self.config, self.drives.rig, silence, brake_time)
        self._side = DriveSide(self, limits, self.settings.lockstep)
        period = None if self.settings.lockstep else self.drives.rig.dt
        self._health = RigHealth(self, self.drives, self.config, period, self._thresholds, self.jump)
        self._period_ns = self.drives.rig.period_ns
        self._voice = RigVoice(self, self.drives, self.config, self.settings.lockstep)
        self._begin()
        self._ahead: list[Sample] | None = None  # in real time: of the tick that comes, not yet told
        self._jump_ns, self._statuses = 0, 0  # of stamps; of the guard, announced so far
        self._connect()

    @property
    def tick(self) -> int:
        """Periods since the start."""
        return self.drives.rig.tick

    def on_alarm(self) -> None:
        """Advance by the periods that have passed; the first one begins with the loop of the node."""
        if not self.tick:
            self._begin(self._period_ns)
        passed = (time.monotonic_ns() - self._started_ns) // self._period_ns
        behind = passed - self.tick + (self._ahead is not None)
        if not behind:
            self._look_ahead()
            return
        self._health.beat(behind)
        if behind > MOST_CATCH_UP:
            self.get_logger().warning(f"stalled for {behind} periods; the simulated arm skips them")
            self._started_ns += (behind - 1) * self._period_ns
            self._epoch_ns += (behind - 1) * self._period_ns
            behind = 1
        for _ in range(behind):
            self.advance()
        self._wait()

    def deactivate(self) -> None:
        """Let time stand."""
        self.alarm.cancel()

    def on_effort(self, msg: JointState) -> None:
        """Take torques of the guard; in lockstep those of the tick that comes move time on."""
        stamp_ns = stamp_to_ns(msg.header.stamp)
        oldest_ns = self.stamp_of(self.tick) - round(self.settings.silence * NS_PER_S)
        mark = self._side.take(msg, oldest_ns)
        if mark is None:
            return
        if not self._side.are_brakes_closed:
            self.drives.open_brakes()
        if not self.settings.lockstep:
            self._look_ahead()
            return
        self._voice.note_sent("applied_effort")
        self._voice.note_sent("guard_status", mark.statuses - self._statuses)
        self._statuses = mark.statuses
        if self._side.is_running and stamp_ns == self.stamp_of(self.tick + 1):
            self._health.beat(1)
            self.advance()
        self._start_when_possible()

    def on_ready(self, partner: str, msg: Bool) -> None:
        """Note that a partner is ready; without its guard the arm is braked to rest, and time stands."""
        if partner == "guard" and self._partners[partner] and not msg.data and self._side.is_running:
            self._stand()
        self._partners[partner] = msg.data
        self._start_when_possible()

    def advance(self) -> None:
        """Move the arm by one period and tell what its sensors say; then choose the next torque."""
        samples = self.drives.advance() if self._ahead is None else self._ahead
        self._ahead = None
        self._voice.say(samples, self.stamp_of)
        self.drives.tau = self._side.choose(self.drives.state().velocity)
        if self._side.are_brakes_closed:
            self.drives.close_brakes()
        self._epoch_ns += self._jump_ns
        self._jump_ns = 0

    def jump(self, by_ns: int) -> None:
        """Let all stamps be later by so much from the period after the next on [ns], as far as stamps go."""
        now_ns = self.stamp_of(self.tick)
        self._jump_ns = max(min(self._jump_ns + by_ns, LAST_STAMP_NS - now_ns), -now_ns)

    def _look_ahead(self) -> None:
        """Find out what there will be to tell at the tick that comes, and put it into words."""
        if self._ahead is None and self.tick:
            self._ahead = self.drives.advance()
            self._voice.make(self._ahead, self.stamp_of)
        self._wait()

    def stamp_of(self, tick: int) -> int:
        """Return the stamp of a tick [ns]."""
        return self._epoch_ns + tick * self._period_ns

    def _begin(self, before_ns: int = 0) -> None:
        """Let tick 0 be so long before now [ns]."""
        self._started_ns = time.monotonic_ns() - before_ns
        now_ns = 0 if self.settings.lockstep else self.get_clock().now().nanoseconds
        self._epoch_ns = now_ns - before_ns

    def _start_when_possible(self) -> None:
        """In lockstep send tick 0 once all listen and the guard has spoken, and go on when one is back."""
        is_wanted = self.settings.lockstep and (self.drives.is_released or self.tick)
        if not is_wanted or not all(self._partners.values()) or self._side.is_running:
            return
        self._side.is_running = True
        if self.tick:
            self._voice.skip()
            self.advance()
        else:
            self._voice.say(self.drives.observe(), self.stamp_of)
            self.drives.tau = self._side.choose(self.drives.state().velocity)

    def _stand(self) -> None:
        """In lockstep let the drives, whose guard has gone, do what they do: then another one may attach."""
        for _ in range(round(LONGEST_STAND * NS_PER_S / self._period_ns)):
            if self._side.stands:
                break
            self.advance()
        self._side.is_running, self._statuses = False, 0

    def _wait(self) -> None:
        """Set the alarm to the period after those that have been told, or to looking ahead to it."""
        told = self.tick - (self._ahead is not None)
        periods = told + 1 if self._ahead is not None or not told else told + PATIENCE
        self.alarm.due = (self._started_ns + periods * self._period_ns) / NS_PER_S

    def _connect(self) -> None:
        newest = LOCKSTEP_QOS if self.settings.lockstep else NEWEST_QOS
        subscribe_bytes(self, JointState, "applied_effort", self.on_effort, newest)
        self._partners = dict.fromkeys(self.settings.partners if self.settings.lockstep else (), False)
        for name in self._partners:
            self.create_subscription(Bool, f"{name}/ready", partial(self.on_ready, name), LATCHED_QOS)
        self.tell_ready({"hardware": lambda: True})
        if not self.settings.lockstep:
            self._wait()


def _plant_of(arm: ManipulatorConfig, simulation: RigSettings) -> Plant:
    return Plant(arm, round(NS_PER_S / arm.rate_hz) * 1e-9, simulation.plant)


AHEAD = (_plant_of, RigSettings)  # see flexarm_model.process.ahead


def main() -> int:
    """Run the node."""
    return run_node(RigNode)
