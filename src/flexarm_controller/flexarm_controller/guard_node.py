"""Guard node: stands between the controller and the drives; nothing else reaches the motors.

Publishes
    applied_effort, guard_status: see ``guard_voice_node``.
    ~/models (std_msgs/String, latched): receipt of the models taken so far.
    ~/ready (std_msgs/Bool, latched): true once the drives obey this guard and have told how the arm moves.
Subscribes
    drive_states (sensor_msgs/JointState): position and velocity as the drives measure them for themselves.
    strain (flexarm_interfaces/StrainArray), model (flexarm_interfaces/ReducedModel, latched).
    joint_commands (flexarm_interfaces/JointCommand), controller/margins (std_msgs/String, latched).
    stop (std_msgs/Empty): latches a stop.
    rig/attached (std_msgs/String, latched): see ``drives.attachment_node``. tick (lockstep only).
Services
    ~/arm, ~/stop (std_srvs/Trigger): let commands pass, unless the arm moves or margins are too small; stop.
Calls
    rig/attach (std_srvs/Trigger): see ``drives.attachment_node``.

It starts stopped, whatever was before. In real time it answers the drives once a period: as soon as it has
the command that is meant for the next one, else after ``patience`` and before ``answer_time``. In lockstep it
answers every command, and while the arm is braked every tick; once it stands, time stands until it is armed.
"""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable
from functools import partial

from flexarm_interfaces.msg import JointCommand, ReducedModel, StrainArray, Tick
from sensor_msgs.msg import JointState
from std_msgs.msg import Empty, String
from std_srvs.srv import Trigger

from flexarm_controller.drives.attachment_node import AttachedGuard
from flexarm_controller.guard import BRAKING, NOT_ARMED_YET
from flexarm_controller.guard_cycle import GuardCycle
from flexarm_controller.guard_exchange import GuardExchange
from flexarm_controller.guard_health import BY_SERVICE, BY_TOPIC
from flexarm_controller.guard_settings import GuardNodeSettings, GuardSettings
from flexarm_controller.guard_voice_node import GuardVoice
from flexarm_model.conversions import stamp_to_ns
from flexarm_model.manipulator.start_pose import starting_at
from flexarm_model.process.ahead import made
from flexarm_model.ros.alarm import Alarm
from flexarm_model.ros.bytes_node import subscribe_bytes
from flexarm_model.ros.declared_node import declare_configs, load_arm, told_by
from flexarm_model.ros.floodgate import Floodgate
from flexarm_model.ros.lockstep import Lockstep, Messages
from flexarm_model.ros.managed_node import LifeSettings, ManagedNode
from flexarm_model.ros.node import (
    LATCHED_QOS,
    LOCKSTEP_QOS,
    MODELS_QOS,
    NEWEST_QOS,
    RELIABLE_QOS,
    SENSOR_QOS,
    run_node,
)
from flexarm_model.settings.diagnosis import DiagnosticsConfig

SENSORS = ("drive_states", "strain")
AHEAD = (GuardExchange, GuardSettings, None)  # see flexarm_model.process.ahead


class GuardNode(ManagedNode):
    """Connects a ``GuardExchange`` to topics and decides when it answers."""

    SETTINGS = (GuardNodeSettings, GuardSettings, DiagnosticsConfig, LifeSettings)

    def __init__(self) -> None:
        """Read the description."""
        super().__init__("guard")
        self.settings: GuardNodeSettings
        self._limits: GuardSettings
        self.settings, self._limits, self._thresholds, life = declare_configs(self)
        config = load_arm(self, self.settings.manipulator, self.settings.preset)
        with told_by(self, "start"):
            self._config = starting_at(config, self.settings.start)
        self.alarm = Alarm(self.on_alarm, time.monotonic)
        self.start(life)

    def activate(self) -> None:
        """Start stopped."""
        self.exchange = made(GuardExchange, self._config, self._limits, 0 if self.settings.lockstep else None)
        self.guard, period, asked = self.exchange.guard, self.exchange.period_ns * 1e-9, self.settings
        self._cycle = GuardCycle(period, asked.patience, asked.answer_time, asked.longest_silence(period))
        self._lockstep, self._margins = Lockstep(SENSORS, self.on_tick_complete), ""
        self._connect()

    def deactivate(self) -> None:
        """Latch a stop; the drives, which hear nothing any more, brake by themselves."""
        self._stop("guard deactivated")
        self._voice.say()
        self.alarm.cancel()

    def on_sensor(self, topic: str, msg: JointState | StrainArray) -> None:
        """Take what drives or gauges measure; the drives begin a period."""
        if self.settings.lockstep:
            self._lockstep.add(topic, msg)
        elif topic == "strain":
            self.exchange.on_strain(msg)
        else:
            self._cycle.begin(now := self._look_at_clock(), self.exchange.on_drive_states(msg))
            self.alarm.due = self._cycle.next_look(now)
            self._floodgate.begin_period()
            self._answer_when_due()

    def on_command(self, msg: JointCommand) -> None:
        """Take a command, and answer the drives if it is for their newest state."""
        self._look_at_clock()  # it may have waited while the guard stood still
        self.exchange.on_command(msg)
        self._answer_when_due()

    def on_tick(self, msg: Tick) -> None:
        """Note what belongs to an instant."""
        self._lockstep.announce(msg.sequence, stamp_to_ns(msg.header.stamp), msg.topics, msg.counts)

    def on_tick_complete(self, stamp_ns: int, messages: Messages) -> None:
        """Take what came with an instant, then answer if that can be done now."""
        for msg in messages.get("strain", ()):
            self.exchange.on_strain(msg)
        for msg in messages.get("drive_states", ()):
            self.exchange.on_drive_states(msg)
            self._cycle.begin(self._now())
        self._answer_when_due()

    def on_alarm(self) -> None:
        """Answer without a command when there is no more time for one; notice that the drives are silent."""
        now = self._look_at_clock()
        self._floodgate.poll()
        if self._cycle.is_open:
            self._answer()
            return
        if silence := self._cycle.silence(now):
            self.guard.stop(silence)
            self._drives.doubt()
        self._voice.say_when_due()
        self.alarm.due = self._cycle.next_look(now)

    def on_model(self, msg: ReducedModel) -> None:
        """Take a model, to be served from its stamp on, or say why not."""
        self.exchange.on_model(msg)
        self._receipts.publish(String(data=self.exchange.receipt))
        if self.exchange.model_fault:
            self.get_logger().error(self.exchange.model_fault)

    def on_margins(self, msg: String) -> None:
        """Note why the controller's loop must not be closed; empty when it may."""
        self._margins = msg.data

    def on_arm(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Arm the guard with a new session token."""
        refusal = self._margins or self.exchange.clock.unready() or self._cycle.silence(self._now())
        refusal = refusal or self._drives.unready(self.exchange.stamp_ns >= 0)
        refusal = refusal or self.guard.unready(not self.settings.lockstep)
        response.success, response.message = not refusal, refusal or "armed"
        if not refusal:
            self.guard.arm(self.exchange.t, 1 + secrets.randbits(62))
            self._voice.say()
            self._resume()
        return response

    def on_stop(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Latch a stop."""
        self._stop(BY_SERVICE)
        response.success, response.message = True, self.guard.reason or "was not armed"
        return response

    def on_release(self, reason: str) -> None:
        """Learn from the drives that they obey this guard no more, or why they let go of the one before."""
        self.guard.release(reason)
        if self.guard.reason == NOT_ARMED_YET:
            self.guard.reason = f"{NOT_ARMED_YET}; before: {reason}"
        self._voice.say_if_time_stands(reason)

    def _stop(self, reason: str) -> None:
        self.guard.stop(reason)
        self._answer_when_due()

    def _answer_when_due(self) -> None:
        """Answer once the next period's command is here; in lockstep that for the newest state, if needed."""
        is_heeded = self.exchange.is_heeded or self.guard.mode == BRAKING
        is_due = is_heeded if self.settings.lockstep else self.exchange.is_commanded
        if self._cycle.is_open and is_due:
            self._answer()

    def _answer(self) -> None:
        """Tell the drives the torque of the next period, once."""
        self._voice.send(self.exchange.answer(), self._drives.seal)
        self._cycle.end(now := self._now())
        self.exchange.look_ahead()
        if not self.settings.lockstep:
            self.alarm.due = self._cycle.next_look(now)

    def _resume(self) -> None:
        """In lockstep let time begin, or go on after a stop."""
        if self.settings.lockstep and self._cycle.is_open:
            self._answer()
        elif self.settings.lockstep and self.exchange.stamp_ns < 0:
            self._voice.send(self.guard.holding, self._drives.seal)

    def _now(self) -> float:
        return 0.0 if self.settings.lockstep else time.monotonic()

    def _look_at_clock(self) -> float:
        """Return the time [s]; a guard that has not run for too long knows nothing of what happened."""
        now = self._now()
        if (stood := self._cycle.look(now)) > self.guard.limits.max_age:
            self.guard.stop(f"guard did not run for {1e3 * stood:.0f} ms")
            self._drives.doubt()
        return now

    def _connect(self) -> None:
        lockstep = self.settings.lockstep
        self._voice = GuardVoice(self, self.exchange, lockstep, lambda: self._cycle.late, self._thresholds)
        self._receipts = self.create_publisher(String, "~/models", LATCHED_QOS)
        newest, every = (LOCKSTEP_QOS,) * 2 if lockstep else (NEWEST_QOS, SENSOR_QOS)  # gauges may be fast
        for topic, kind, quality in zip(SENSORS, (JointState, StrainArray), (newest, every), strict=True):
            subscribe_bytes(self, kind, topic, partial(self.on_sensor, topic), quality)
        self.create_subscription(ReducedModel, "model", self.on_model, MODELS_QOS)
        heard = JointCommand, "joint_commands", self.on_command, every, self.exchange.refuse
        asked = subscribe_bytes(self, *heard)
        self.create_subscription(String, "controller/margins", self.on_margins, LATCHED_QOS)
        self.create_subscription(Empty, "stop", lambda msg: self._stop(BY_TOPIC), RELIABLE_QOS)
        self.create_service(Trigger, "~/arm", self.on_arm)
        self.create_service(Trigger, "~/stop", self.on_stop)
        self._drives = AttachedGuard(self, self.on_release, lockstep)
        if lockstep:
            self.create_subscription(Tick, "tick", self.on_tick, LOCKSTEP_QOS)
        else:
            self._floodgate = Floodgate(self, asked)
            self.alarm.due = self._cycle.next_look(self._now())
        self.tell_ready(self._conditions())

    def _conditions(self) -> dict[str, Callable[[], bool]]:
        """Return what must hold before the node is ready; in lockstep no message may be lost."""
        conditions: dict[str, Callable[[], bool]] = {"the drives": lambda: not self._drives.refusal}
        if self.settings.lockstep:
            conditions |= {t: partial(self.has_publisher, t) for t in (*SENSORS, "tick", "joint_commands")}
            conditions["drives and estimator"] = lambda: self._voice.listeners()[0] > 1
            conditions["the controller"] = lambda: self._voice.listeners()[1] > 0
        else:
            conditions["their states"] = lambda: self.guard.has_watched
        return conditions


def main() -> int:
    """Run the node."""
    return run_node(GuardNode)
