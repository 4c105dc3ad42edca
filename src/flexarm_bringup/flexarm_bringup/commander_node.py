"""Commander node: moves the arm through a series of rest-to-rest motions and ends.

It waits until everybody is ready, sends the series as one reference, waits until the controller has taken
it and everybody holds the models that the arm will need on the way, arms the guard, and exits when the last
move has had its time: 0 when all was done, 1 with the reason when something refused.

Publishes
    reference (trajectory_msgs/JointTrajectory): once; its stamp is time zero of the series.
Subscribes
    controller_status, guard_status, modal_state, joint_states, ~/ready of the partners, and ~/models of
    those who make and use models.
Calls
    guard/arm (std_srvs/Trigger).
"""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from flexarm_interfaces.msg import ControllerStatus, GuardStatus, ModalState
from rclpy.clock import Clock, ClockType
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, String
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory

from flexarm_bringup.demo_run.motions import motions, out_and_back, reference_of
from flexarm_bringup.series import Series, SeriesError
from flexarm_bringup.tasks.reference_file import load_reference
from flexarm_controller.conversions import reference_to_msg
from flexarm_controller.reference import Reference
from flexarm_model.conversions import stamp_to_ns
from flexarm_model.ros.declared_node import declare_configs, load_arm
from flexarm_model.ros.logger_node import FastLogging
from flexarm_model.ros.node import (
    LATCHED_QOS,
    LOCKSTEP_QOS,
    RELIABLE_QOS,
    SENSOR_QOS,
    run_node,
)
from flexarm_model.settings.arm_settings import ArmSettings
from flexarm_model.settings.parameters import parameter

LOOK_PERIOD = 0.02  # s of wall time between two looks at the state of affairs
LISTENERS = ("model", "controller", "recorder")  # partners that must hear the reference
HOLDERS = ("estimator", "controller", "guard")  # partners that must hold the models of the motion
MOTIONS = ("A", "B", "ZVD")


@dataclass(frozen=True)
class CommanderSettings(ArmSettings):
    """Settings of the commander node."""

    lockstep: bool = parameter(False, "The rig runs in lockstep: time starts at zero when it is armed.")
    angles: tuple[float, ...] = parameter(
        (10.0, 30.0, 60.0), "Size of the moves, one out and back each.", "deg", 0.1, 170.0
    )
    out: str = parameter("A", "Motion on the way out.", choices=MOTIONS)
    back: str = parameter("ZVD", "Motion on the way back.", choices=MOTIONS)
    zeta: float = parameter(0.015, "Damping ratio that the shaper counts on.", "1", 0.0, 0.5)
    reference: str = parameter("", "File with a reference to follow instead of moves (reference_file).")
    preparation: float = parameter(
        1.0,
        "In real time the series starts so much after it was sent; where models are not ready by then it is "
        "sent again, with twice the time.",
        "s",
        0.05,
        600.0,
    )
    partners: tuple[str, ...] = parameter(
        ("model", "estimator", "controller", "guard", "rig"), "Nodes to wait for."
    )
    patience: float = parameter(60.0, "Longest wait without any progress.", "s", 1.0, 3600.0)


class Commander(FastLogging):
    """Steps: wait for partners, send, wait for the answer, arm, wait for the end."""

    SETTINGS = (CommanderSettings,)

    def __init__(self) -> None:
        """Prepare the series and connect."""
        super().__init__("commander", namespace="flexarm")
        self.settings: CommanderSettings
        (self.settings,) = (s,) = declare_configs(self)
        config = load_arm(self, s.manipulator, s.preset)
        self._period_ns, self._preparation = round(1e9 / config.rate_hz), s.preparation
        self._reference, end = _series(s, 1.0 / config.rate_hz)
        self._names = tuple(config.actuated)
        self._duration_ns = round(end * 1e9)
        self._zero_ns, self._now_ns = 0, -1
        self._has_state = s.lockstep
        self._ready = dict.fromkeys(s.partners, False)
        steps = (
            self._wait_for_partners,
            self._wait_for_state,
            self._send,
            self._wait_for_answer,
            self._wait_for_models,
            self._arm,
            self._wait_for_arming,
            self._wait_for_end,
        )
        self._series = Series(steps, s.patience, time.monotonic())
        self._answer, self._sent_ns = "", -1
        self._receipts = dict.fromkeys(("model", *HOLDERS), "")
        self._arming: Any = None
        self._guard, self._was_armed = GuardStatus(), False  # it may be stopped again at once
        self._connect()

    @property
    def is_finished(self) -> bool:
        """Whether the series is over, or cannot be."""
        return self._series.is_over

    def stop(self) -> None:
        """Say why the series did not come to its end, and keep it as the exit code."""
        self._series.end("interrupted")
        self.exit_code = 1 if self._series.outcome else 0
        if self._series.outcome:
            print(f"commander: {self._series.outcome}", file=sys.stderr)

    def on_look(self) -> None:
        """Take the next step if it can be taken."""
        self._series.look(time.monotonic())

    def _wait_for_partners(self) -> bool:
        listeners = sum(name in self._ready for name in LISTENERS)
        return all(self._ready.values()) and self._publisher.get_subscription_count() >= max(listeners, 1)

    def _wait_for_state(self) -> bool:
        return self._has_state and (self.settings.lockstep or self._now_ns > 0)

    def _send(self) -> bool:
        periods = round(self._preparation * 1e9 / self._period_ns)  # on the rig's ticks
        self._zero_ns = 0 if self.settings.lockstep else self._now_ns + periods * self._period_ns
        msg = reference_to_msg(self._reference, self._names, self._zero_ns)
        self._sent_ns = stamp_to_ns(msg.header.stamp)
        self._publisher.publish(msg)
        return True

    def _wait_for_answer(self) -> bool:
        if self._answer.startswith("reference refused"):
            raise SeriesError(self._answer)
        return self._answer.startswith("reference accepted")

    def _wait_for_models(self) -> bool:
        if "model" not in self._ready:
            return True
        stamp, _, made = self._receipts["model"].partition(": ")
        if stamp != str(self._sent_ns):
            return False
        if made.startswith("refused"):
            raise SeriesError(f"models {made}")
        if self._now_ns > self._zero_ns and not self.settings.lockstep:
            return self._send_again((self._now_ns - self._zero_ns) * 1e-9)
        return all(self._receipts[name] == made for name in HOLDERS if name in self._ready)

    def _send_again(self, late: float) -> bool:
        """Send once more what was answered so ``late`` [s]: the models are at hand now, and come sooner."""
        if 2.0 * self._preparation > self.settings.patience:
            raise SeriesError(f"models are not ready {late:.2f} s after the start; raise preparation")
        self._preparation *= 2.0
        text = f"models came {late:.2f} s after the start: once more, {self._preparation:g} s from now"
        self.get_logger().warning(text)
        self._send()
        return False

    def _arm(self) -> bool:
        if self._client.service_is_ready():
            self._arming = self._client.call_async(Trigger.Request())
        return self._arming is not None

    def _wait_for_arming(self) -> bool:
        if self._was_armed:
            return True
        if self._arming.done() and not self._arming.result().success:
            raise SeriesError(f"guard refused to arm: {self._arming.result().message}")
        return False

    def _wait_for_end(self) -> bool:
        if self._answer.startswith("reference dropped"):
            raise SeriesError(self._answer)
        is_over = self._now_ns - self._zero_ns >= self._duration_ns
        if not is_over and self._guard.mode != GuardStatus.ARMED:
            raise SeriesError(f"guard stopped the arm: {self._guard.reason}")
        return is_over

    def _on_joint_states(self, msg: JointState) -> None:
        # what comes before the last step must not take long, whatever the sensors say
        if self._series.is_last and stamp_to_ns(msg.header.stamp) > self._now_ns + self.settings.lockstep:
            self._series.note(time.monotonic())
        self._now_ns = stamp_to_ns(msg.header.stamp)

    def _on_status(self, msg: ControllerStatus) -> None:
        if msg.reason.startswith("reference"):
            self._answer = msg.reason

    def _on_state(self, msg: ModalState) -> None:
        self._has_state = self._has_state or msg.status == ModalState.OK

    def _on_guard(self, msg: GuardStatus) -> None:
        self._guard = msg
        self._was_armed |= self._arming is not None and msg.mode == GuardStatus.ARMED

    def _connect(self) -> None:
        self._publisher = self.create_publisher(JointTrajectory, "reference", RELIABLE_QOS)
        self.create_subscription(JointState, "joint_states", self._on_joint_states, SENSOR_QOS)
        self.create_subscription(ControllerStatus, "controller_status", self._on_status, LOCKSTEP_QOS)
        self.create_subscription(GuardStatus, "guard_status", self._on_guard, RELIABLE_QOS)
        self.create_subscription(ModalState, "modal_state", self._on_state, SENSOR_QOS)
        for name in self._ready:
            self.create_subscription(
                Bool,
                f"{name}/ready",
                lambda msg, name=name: self._ready.__setitem__(name, msg.data),
                LATCHED_QOS,
            )
        for name in self._receipts:
            self.create_subscription(
                String,
                f"{name}/models",
                lambda msg, name=name: self._receipts.__setitem__(name, msg.data),
                LATCHED_QOS,
            )
        self._client = self.create_client(Trigger, "guard/arm")
        self.create_timer(LOOK_PERIOD, self.on_look, clock=Clock(clock_type=ClockType.STEADY_TIME))


def _series(settings: CommanderSettings, dt: float) -> tuple[Reference, float]:
    """Return what to follow and until when it is watched [s]."""
    if settings.reference:
        return load_reference(Path(settings.reference))
    angles = [float(np.radians(angle)) for angle in settings.angles]
    moves = out_and_back(angles, settings.out, settings.back, motions(settings.zeta))
    return reference_of(moves, dt), moves[-1].slot_end


def main() -> int:
    """Run the node until its series is over; unlike the others it ends by itself."""
    return run_node(Commander)
