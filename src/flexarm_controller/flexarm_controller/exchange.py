"""The controller between messages: what comes in, what goes out, no topics and no clock.

The node connects it to DDS, the replay to a bag; both therefore do the same.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from flexarm_controller.answer import Answer, AnswerTeller, Outgoing
from flexarm_controller.controller import Controller
from flexarm_controller.conversions import (
    ReferenceMessageError,
    command_to_msg,
    notice_msg,
    reference_from_msg,
)
from flexarm_controller.cycles import Cycles
from flexarm_controller.guard_session import GuardSession
from flexarm_controller.laws import Laws
from flexarm_controller.limits import limits_of
from flexarm_controller.motion.admission import admit, check_begin
from flexarm_controller.motion.arm_loads import ArmLoads
from flexarm_controller.motion.conversions import OWN_FRAME
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.nonlinear.settings import NmpcConfig
from flexarm_controller.reference_queue import describe_queued
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_controller.state import ArmState
from flexarm_controller.time_budget import Clocks
from flexarm_controller.told_state import SentState, ToldState
from flexarm_model.conversions import ModelMessageError, model_from_msg, stamp_to_ns
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.served.pending_models import PendingModels
from flexarm_model.served.same_arm import foreign_model

REFUSED = "reference refused: "
LATE = 0.2  # s that a reference may have begun before it comes


class ControllerExchange:
    """Owns the controller and translates.

    Attributes:
        controller: None until a model has been accepted.
        state: The newest one; None before the first.
        model_fault: Why the last model was refused; empty when it was taken.
        is_live: The clock drives the loop; else it is in lockstep.
        withheld: Why no command may be sent; empty when they may.
        guard: What the guard has said.
        answer: What became of the newest state; None before the first.
        teller: Tells of answers.
        loads: Of the arm away from the pose of its model, where somebody knows its dynamics.
        write: Makes the message of a command, of what ``command_to_msg`` takes.
    """

    def __init__(  # noqa: PLR0913, one settings class for each thing that is set
        self,
        config: ManipulatorConfig,
        settings: ControllerConfig,
        mpc: MpcConfig,
        epoch_ns: int | None,
        clocks: Clocks | None = None,
        motion: MotionConfig | None = None,
        nmpc: NmpcConfig | None = None,
    ) -> None:
        """Start without a model.

        Args:
            config: The manipulator.
            settings: Law and fallbacks.
            mpc: Weights, horizon, solver.
            epoch_ns: Stamp that is time zero [ns]; None takes the first state's: the clock drives the loop.
            clocks: Of CPU time and, in real time, of the wall.
            motion: What becomes of references that are too fast.
            nmpc: What the nonlinear law adds to ``mpc``.
        """
        self._config, self._settings, self._clocks = config, settings, clocks
        self._mpc, self._nmpc, self._motion = mpc, nmpc, motion or MotionConfig()
        self._names, self._limits = tuple(config.actuated), limits_of(config)
        self._epoch_ns, self.is_live, self._cycles = epoch_ns, epoch_ns is None, Cycles(settings.period)
        self.guard = GuardSession(settings.period if self.is_live else None)
        self._pending: PendingModels[Laws] = PendingModels()
        self.controller: Controller | None = None
        self.state: ArmState | None = None
        self.loads: ArmLoads | None = None
        self.write: Callable[..., Any] = command_to_msg
        self.teller = AnswerTeller(settings.period, mpc.backend, is_live=epoch_ns is None)
        self.answer: Answer | None = None
        self.model_fault, self.withheld = "no model yet", ""

    @property
    def receipt(self) -> str:
        """What models have been taken, in short; equal at all who took the same."""
        return self._pending.receipt

    @property
    def epoch_ns(self) -> int | None:
        """Stamp that is time zero [ns]; None until it is known."""
        return self._epoch_ns

    @property
    def is_armed(self) -> bool:
        """Whether the guard lets commands pass, by what it said last."""
        return bool(self.guard.token)

    def on_model(self, msg: Any) -> list[Outgoing]:
        """Take a model of the same description, to be used from its stamp on; refuse another by name.

        The first one is used at once; the laws of the others are built now and wait.
        """
        try:
            model = model_from_msg(msg)
        except ModelMessageError as error:
            return self._refuse_model(msg, f"model refused: {error}")
        if foreign := foreign_model(model, self._config, "the controller"):
            return self._refuse_model(msg, foreign)
        self.model_fault, stamp_ns = "", stamp_to_ns(msg.header.stamp)
        try:
            if self.controller is None:
                self.controller = Controller(
                    model, self._limits, self._settings, self._mpc, self._clocks, self._config, self._nmpc
                )
            else:
                self._pending.add(stamp_ns, self.controller.prepare(model))
                self._foresee()
        except (KeyError, ValueError) as error:  # no law can be made of it
            return self._refuse_model(msg, f"model refused: {error}")
        self._pending.note(stamp_ns, model.model_id)
        return []

    def work_ahead(self) -> None:
        """Let the law prepare for the next state; to be called when the answer to this one is out."""
        if self.controller is not None and self.is_armed:
            self.controller.work_ahead()

    def on_guard_status(self, msg: Any) -> list[Outgoing]:
        """Take the session token; whatever was planned is void when the session ends.

        A reference that began while nobody was armed is not run after: the arm would rush to where it leads.
        """
        was_armed = self.is_armed
        if not self.guard.hear(msg) or self.controller is None or (now := self._now) is None:
            return []
        if was_armed:  # also when the stop was not heard
            return self.tell_dropped("the guard stopped before it began") if self.controller.reset() else []
        if (begun := self.controller.drop_reference(now - LATE)) is None:
            return []
        return self.tell_dropped(f"it began {now - begun:.3g} s ago, when the guard was not armed")

    def tell_dropped(self, why: str) -> list[Outgoing]:
        """Say that a reference is not followed any more, and why."""
        return self._notice(f"reference dropped: {why}", self._cycles.last_ns or 0)

    def on_reference(self, msg: Any) -> list[Outgoing]:
        """Take a reference or refuse it; the answer says which, and why."""
        try:
            answer = "; ".join([f"reference accepted: {len(msg.points)} points", *self._take_reference(msg)])
        except (ReferenceMessageError, MotionError) as error:
            answer = f"{REFUSED}{error}"
        return self._notice(answer, stamp_to_ns(msg.header.stamp))

    def refuse_reference(self, reason: str) -> list[Outgoing]:
        """Say why a reference was not read."""
        return self._notice(f"{REFUSED}{reason}", self._cycles.last_ns or 0)

    def on_modal_state(self, msg: Any) -> list[Outgoing]:
        """Answer a state that was sent, and tell what there is to tell of the answer."""
        return [*self.on_state(SentState(msg)), *self.tell()]

    def on_state(self, told: ToldState) -> list[Outgoing]:
        """Answer a state with a command; without a session with nothing. What else there is: ``tell``."""
        stamp_ns = told.stamp_ns
        if not self._cycles.note(stamp_ns):
            self.answer = None
            return []
        self.guard.note(stamp_ns)
        if self._epoch_ns is None:
            self._epoch_ns = stamp_ns
            self._foresee()
        if self.controller is None:
            return self._send_nothing(stamp_ns, self.model_fault)
        if (laws := self._pending.due(stamp_ns)) and laws.model.model_id != self.controller.model.model_id:
            self.controller.adopt(laws)
        self.state = told.read(self.controller.model, self._epoch_ns)
        if self.withheld or not self.is_armed:
            return self._send_nothing(stamp_ns, self.withheld or self.guard.fault)
        command = self.controller.step(self.state)
        if command.mode == "inactive":
            return self._send_nothing(stamp_ns, command.reason, is_left=True)
        rest = *self._counts, self.controller.notice
        self.answer = Answer(stamp_ns, command.mode, command.reason, command, *rest)
        self.guard.sequence += 1
        msg = self.write(command, self._names, self.guard.sequence, self.guard.token, stamp_ns)
        return [Outgoing("joint_commands", msg)]

    def tell(self) -> list[Outgoing]:
        """Return what has time until the answer to a state is out: its status, if that is due, and debug."""
        if self.answer is None:
            return []
        told = self.teller.tell(self.answer)
        if self.controller is None or self.state is None:
            return told
        return told + self.teller.look_ahead(self.answer, self.controller.model, self.state)

    @property
    def _now(self) -> float | None:
        """Stamp of the newest state [s]; None before the first."""
        if self._cycles.last_ns is None or self._epoch_ns is None:
            return None
        return (self._cycles.last_ns - self._epoch_ns) * 1e-9

    def _foresee(self) -> None:
        """Tell the controller which models wait, and from when each holds."""
        if self.controller is not None and self._epoch_ns is not None:
            waiting = self._pending.waiting
            self.controller.foresee([((ns - self._epoch_ns) * 1e-9, laws.model) for ns, laws in waiting])

    def _take_reference(self, msg: Any) -> tuple[str, ...]:
        """Follow a reference; returns remarks. Raises why it is refused."""
        if self.controller is None or self._epoch_ns is None:
            raise MotionError(self.model_fault or "no state yet")
        model, now, is_awaited = self.controller.model, self._now, self.is_armed and self.is_live
        reference = reference_from_msg(msg, self._names, self._epoch_ns)
        check_begin(0.0 if now is None else float(reference.t[0]) - now, LATE)
        limits = self._limits.without_strain() if msg.header.frame_id == OWN_FRAME else self._limits
        reference, remark = admit(reference, model, limits, self._motion, is_awaited, self.loads)
        under_way = self.controller.queue.leading if self.is_armed else None
        queued = describe_queued(under_way, reference, now, self._settings.period)
        if fault := self.controller.follow(reference):
            raise MotionError(fault)
        return tuple(said for said in (remark, queued) if said)

    def _refuse_model(self, msg: Any, reason: str) -> list[Outgoing]:
        self.model_fault = reason
        return self._notice(reason, stamp_to_ns(msg.header.stamp))

    def _send_nothing(self, stamp_ns: int, reason: str, is_left: bool = False) -> list[Outgoing]:
        self.answer = Answer(stamp_ns, "inactive", reason, None, *self._counts, is_left=is_left)
        return []

    def _notice(self, reason: str, stamp_ns: int) -> list[Outgoing]:
        return [Outgoing("controller_status", notice_msg(reason, stamp_ns, *self._counts))]

    @property
    def _counts(self) -> tuple[int, int]:
        """Missed cycles and overruns so far."""
        return self._cycles.missed, 0 if self.controller is None else self.controller.overruns
