"""Goals of the tip between messages: requests come in, responses, references and progress go out.

A reference made here is also sent on the topic ``reference``, so that the model node makes the models of the
motion and a bag holds what was followed. The controller takes that very message as it takes any other, and
a replay does the same.

Where the model node has no models for what is followed, or says nothing of it, the arm is brought to rest:
the law would go on with the model of another pose, or the arm cannot stand where it is led.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from flexarm_controller.answer import Outgoing
from flexarm_controller.exchange import REFUSED, ControllerExchange
from flexarm_controller.limits import limits_of
from flexarm_controller.motion.conversions import (
    cancel_response,
    goal_from_request,
    move_response,
    own_reference_msg,
    progress_to_msg,
)
from flexarm_controller.motion.models_awaited import ModelsAwaited
from flexarm_controller.motion.motion_server import Answer, MotionServer
from flexarm_controller.motion.progress import Progress
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.motion.tip_kinematics import TipKinematics
from flexarm_controller.reference import Reference
from flexarm_controller.state import ArmState
from flexarm_model.conversions import stamp_to_ns
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.served.parameter_watch import PARAMETER_STEP, ParameterWatch
from flexarm_model.served.reduced_model import ReducedModel


class MotionExchange:
    """Owns the motion server of one controller.

    Attributes:
        arm: The manipulator.
        has_models: Whether somebody makes the models of motions, and says so.
    """

    def __init__(
        self,
        config: ManipulatorConfig,
        tip: TipKinematics,
        motion: MotionConfig,
        period: float,
        exchange: ControllerExchange,
        goals: int = 0,
    ) -> None:
        """Start without a goal.

        Args:
            config: The manipulator.
            tip: Its kinematics.
            motion: Limits and tolerances of motions.
            period: Of the controller [s].
            exchange: Of the controller that follows.
            goals: Number of the last goal before.
        """
        self._exchange, self._names, self.arm = exchange, tuple(config.actuated), config
        self._parameters = ParameterWatch(config, PARAMETER_STEP)
        self._server = MotionServer(tip, limits_of(config), motion, period, goals)
        exchange.loads = self._server.loads
        self._models = ModelsAwaited()
        self.has_models: Callable[[], bool] = _nobody

    def on_reference(self, msg: Any) -> list[Outgoing]:
        """Answer a reference of others; returns what is to be sent, the verdict first."""
        answer = self._exchange.on_reference(msg)
        if not answer[0].msg.reason.startswith(REFUSED):
            self._models.follow(stamp_to_ns(msg.header.stamp), self.has_models())
        return answer + self._give_up()

    def on_parameter(self, name: str, value: float, variance: float) -> None:
        """Hear what a named parameter of the arm is now [SI]."""
        self._parameters.hear(name, value, variance)
        if self._parameters.is_due:
            self._parameters.use(self._parameters.told())
            self._server.lead(self._parameters.used)
            self._exchange.loads = self._server.loads

    def on_models(self, text: str) -> list[Outgoing]:
        """Hear what the model node says of a reference: "stamp: receipt" or "stamp: refused: reason"."""
        self._models.hear(text)
        return self._give_up()

    def on_move_tip(self, request: Any) -> tuple[Any, list[Outgoing]]:
        """Answer a goal; returns the response and what is to be sent."""
        arm, why = self._arm(), ""
        try:
            goal = goal_from_request(request)
        except MotionError as error:
            why = str(error)
        if not why and not isinstance(arm, str):
            answer = self._server.move_tip(goal, arm, arm.state)
            return move_response(answer), [*self._sent(arm, self.has_models()), *self._told(arm)]
        why = why or str(arm)
        if isinstance(stopped := self._arm(is_armed=True), str):
            return move_response(Answer(False, why)), []
        return move_response(self._server.reject(stopped.state.t, why)), self._told(stopped)

    def on_cancel(self, request: Any) -> tuple[Any, list[Outgoing]]:
        """Answer a cancellation; returns the response and what is to be sent."""
        arm = self._arm()
        if isinstance(arm, str):
            return self._take_back(request.goal_id, arm)
        answer = self._server.cancel(request.goal_id, arm, arm.state)
        return cancel_response(answer), [*self._sent(arm), *self._told(arm)]

    def _take_back(self, goal_id: int, why: str) -> tuple[Any, list[Outgoing]]:
        """Forget a reference that waits for the guard to be armed, if any reference is meant."""
        arm = self._arm(is_armed=True)
        if goal_id or isinstance(arm, str) or not arm.forget():
            return cancel_response(Answer(False, why)), []
        dropped = self._exchange.tell_dropped("canceled before the guard was armed")
        return cancel_response(Answer(True)), dropped

    def update(self) -> list[Outgoing]:
        """Return what there is to tell after a state."""
        arm = self._arm(is_armed=True)
        if isinstance(arm, str):
            return []
        if self._exchange.is_armed and (silence := self._exchange.guard.fault) and self._server.is_pursuing:
            self._server.cancel(0, arm, arm.state, silence)  # it may hear without being heard
            return [*self._sent(arm), *self.end(silence)]
        return [*self._give_up(), *self._told(arm)]

    def end(self, why: str) -> list[Outgoing]:
        """Give up what is pursued, for the arm is not moved any more; returns the last word on it."""
        arm = self._arm(is_armed=True)
        return [] if isinstance(arm, str) else _said(self._server.end(arm.state.t, why), arm)

    def _give_up(self) -> list[Outgoing]:
        """Bring the arm to rest if there are no models for what it follows; returns what is to be sent."""
        arm = self._arm(is_armed=True)
        if isinstance(arm, str) or not (reason := self._models.missing(arm.now_ns)):
            return []
        self._models.forget()
        words = [f"no models for it: {reason}"]
        if self._exchange.is_armed:
            words += filter(None, [self._server.cancel(0, arm, arm.state, words[0]).reason])
        else:
            arm.forget()
        said = self._exchange.refuse_reference("; ".join(words))
        return [*said, *self._sent(arm), *self._told(arm)]

    def _sent(self, arm: _Arm, is_awaited: bool = False) -> list[Outgoing]:
        """Return the references that an arm has taken, and what was said; those to rest need no models."""
        for out in arm.sent:
            if out.topic == "reference":
                self._models.follow(stamp_to_ns(out.msg.header.stamp), is_awaited)
        return arm.sent

    def _told(self, arm: _Arm) -> list[Outgoing]:
        return _said(self._server.update(arm, arm.state), arm)

    def _arm(self, is_armed: bool = False) -> _Arm | str:
        """Return the controller as what follows references, or why nothing may move."""
        exchange = self._exchange
        if exchange.controller is None:
            return exchange.model_fault
        if exchange.state is None or exchange.epoch_ns is None:
            return "no state yet"
        if not is_armed and exchange.guard.fault:
            return exchange.guard.fault
        return _Arm(exchange, exchange.state, self._names, exchange.epoch_ns)


class _Arm:
    """The controller, by way of messages; ``sent`` holds the references it has taken."""

    def __init__(
        self, exchange: ControllerExchange, state: ArmState, names: tuple[str, ...], epoch_ns: int
    ) -> None:
        assert exchange.controller is not None
        self._exchange, self._controller, self._names = exchange, exchange.controller, names
        self.state, self.epoch_ns = state, epoch_ns
        self.sent: list[Outgoing] = []

    @property
    def now_ns(self) -> int:
        """Stamp of the state [ns]."""
        return self.epoch_ns + round(1e9 * self.state.t)

    @property
    def model(self) -> ReducedModel:
        """The served model in use."""
        return self._controller.model

    @property
    def reference(self) -> Reference | None:
        """What is followed."""
        return self._controller.reference

    def follows(self, reference: Reference | None) -> bool:
        """Tell whether this very reference is followed now, or waits for its begin."""
        return self._controller.queue.follows(reference, self.state.t)

    @property
    def ended_by(self) -> str:
        """Why nothing is followed any more: the guard has stopped the arm, or its state was lost."""
        exchange = self._exchange
        if exchange.is_armed and exchange.answer is not None and exchange.answer.reason:
            return exchange.answer.reason
        return ": ".join(filter(None, ("the arm was stopped", exchange.guard.stopped_by)))

    def forget(self) -> bool:
        """Follow nothing; returns whether a reference was waiting."""
        return self._controller.drop_reference(math.inf) is not None

    def follow(self, reference: Reference) -> str:
        """Hand a reference to the controller as it is sent; returns why it is refused."""
        msg = own_reference_msg(reference, self._names, self.epoch_ns)
        (answer,) = self._exchange.on_reference(msg)
        if answer.msg.reason.startswith(REFUSED):
            return str(answer.msg.reason).removeprefix(REFUSED)
        self.sent += [Outgoing("reference", msg), answer]
        return ""


def _nobody() -> bool:
    return False


def _said(told: Sequence[Progress], arm: _Arm) -> list[Outgoing]:
    return [Outgoing("motion_status", progress_to_msg(item, arm.epoch_ns)) for item in told]
