"""The guard between messages: what comes in, what goes out, no topics and no clock.

The node connects it to DDS and says when to answer.
"""

from __future__ import annotations

from typing import Any

from flexarm_controller.drives.conversions import command_from_msg, drive_state_from_msg
from flexarm_controller.drives.drive_clock import DriveClock
from flexarm_controller.due_commands import DueCommands
from flexarm_controller.guard import Guard, GuardState
from flexarm_controller.guard_settings import GuardSettings, gauges_of, guard_limits, hold_of
from flexarm_controller.guarding.pose_loads import PoseLoads
from flexarm_model.conversions import LAST_STAMP_NS, NS_PER_S, stamp_to_ns
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.served.pending_models import PendingModels
from flexarm_model.served.same_arm import foreign_model
from flexarm_model.tree.reduced_tree import ReducedTree

STARTING_NS = NS_PER_S  # of answers, in which gauges may start beside the drives; diagnostics come as often


class GuardExchange:
    """Owns the guard and translates.

    Attributes:
        guard: The guard, stopped at first.
        names: Actuated axes.
        period_ns: Motor period [ns].
        clock: Of the drives, by their stamps.
        stamp_ns: Of the drives' newest state [ns]; -1 before the first.
        model_fault: Why the last model was refused; empty when it was taken.
    """

    def __init__(self, config: ManipulatorConfig, settings: GuardSettings, epoch_ns: int | None) -> None:
        """Start stopped.

        Args:
            config: The manipulator; its rate is that of the motors.
            settings: Of the guard.
            epoch_ns: Stamp that is time zero [ns]; None takes the first state's.
        """
        tree = ReducedTree(config)
        self._config, self._epoch_ns = config, epoch_ns
        self.names, self.period_ns = tuple(config.actuated), round(NS_PER_S / config.rate_hz)
        self.guard = Guard(guard_limits(config, tree, settings))
        self.clock = DriveClock(self.period_ns, self.guard.limits.max_age)
        self._loads = PoseLoads(tree, hold_of(self.guard.limits, settings))
        self._gauges = gauges_of(config)
        self._models: PendingModels[str] = PendingModels()
        self.stamp_ns, self.model_fault = -1, ""
        self._state = GuardState(())
        self._commands, self._newest_ns = DueCommands(self.period_ns * 1e-9), -1
        self._newest = 0, 0  # session and sequence

    @property
    def receipt(self) -> str:
        """What models have been taken, in short; equal at all who took the same."""
        return self._models.receipt

    @property
    def answer_ns(self) -> int:
        """Stamp of the period that an answer is for [ns]."""
        return self.stamp_ns + self.period_ns if self.stamp_ns >= 0 else 0

    @property
    def t(self) -> float:
        """Begin of the period that an answer is for [s]."""
        return self._seconds(self.answer_ns)

    @property
    def is_commanded(self) -> bool:
        """Whether there is a command for the period that an answer is for."""
        return self._commands.has(self.t)

    @property
    def is_heeded(self) -> bool:
        """Whether the newest command was computed from the drives' newest state."""
        return self._newest_ns == self.stamp_ns

    @property
    def unheard(self) -> tuple[str, ...]:
        """Gauges with a limit that have said nothing since the guard began; none in its first second."""
        if self.guard.ticks * self.period_ns < STARTING_NS:
            return ()
        return tuple(map(self.guard.limits.gauge, self._gauges.unheard))

    def on_model(self, msg: Any) -> None:
        """Take a model of the same description, to be served from its stamp on; refuse another by name."""
        self.model_fault = foreign_model(msg, self._config, "the guard")
        if self.model_fault:
            return
        stamp_ns = stamp_to_ns(msg.header.stamp)
        self._models.add(stamp_ns, msg.model_id)
        self._models.note(stamp_ns, msg.model_id)

    def on_strain(self, msg: Any) -> None:
        """Keep what gauges say until the next answer: of every channel the strain of largest magnitude."""
        self._gauges.hear(msg.names, msg.strain)

    def on_drive_states(self, msg: Any) -> int:
        """Take what the drives measure; return how many periods after the last time.

        A clock that was set back or stands, stamps half a period apart, or a gap that is longer than any
        silence may be stop the arm.
        """
        stamp_ns = min(stamp_to_ns(msg.header.stamp), LAST_STAMP_NS)
        if self._epoch_ns is None:
            self._epoch_ns = stamp_ns
        passed = self.clock.take(stamp_ns)
        if self.clock.fault:
            self.guard.stop(self.clock.fault)
        self._state, self.stamp_ns = drive_state_from_msg(msg, self.names), stamp_ns
        return passed

    def on_command(self, msg: Any) -> None:
        """Keep the newest command of the session; of others, which may be large, nothing more is read."""
        token, sequence = msg.session_token, msg.sequence
        if not token or token != self.guard.token:
            self.refuse("command of another session" if self.guard.token else "guard is not armed")
        elif self._newest[0] == token and sequence <= self._newest[1]:
            self.refuse(f"command {sequence} is not newer than {self._newest[1]}")
        elif tuple(msg.names) != self.names:
            self.refuse(f"command is not for the axes {', '.join(self.names)}, in this order")
        else:
            if self._newest[0] != token:
                self._commands.clear()
            self._newest, self._newest_ns = (token, sequence), stamp_to_ns(msg.header.stamp)
            self._commands.add(command_from_msg(msg, self._epoch_ns or 0, self.period_ns))

    def answer(self) -> list[float]:
        """Return the torque of the next period [N m] or [N], one per axis."""
        model_id = self._models.due(self.stamp_ns)
        if model_id is not None:
            self.guard.serve(model_id, self.t)
        command = self._commands.take(self.t)
        state = GuardState(self._state.velocity, self._state.position, self._gauges.read())
        self._gauges.begin()
        return self.guard.step(command, state, self.t)

    def look_ahead(self) -> None:
        """Find out what loads the arm where it is now; to be called when the answer is out."""
        known = len(self._state.position) == len(self.names)
        loads = self._loads.look(self._state.position) if known else None
        if loads is not None:
            self.guard.carry(loads)

    def refuse(self, reason: str) -> None:
        """Count a command that is not taken."""
        self.guard.refused += 1
        self.guard.refusal = reason

    def _seconds(self, stamp_ns: int) -> float:
        return (stamp_ns - (self._epoch_ns or 0)) * 1e-9
