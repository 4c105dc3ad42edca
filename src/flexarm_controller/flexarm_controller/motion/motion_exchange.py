"""Goals of the tip between messages: requests come in, responses, references and progress go out.

A reference made here is also sent on the topic ``reference``, so that the model node makes the models of the
motion and a bag holds what was followed. The controller takes that very message as it takes any other, and
a replay does the same.

Where the model node has no models for what is followed, or says nothing of it, the arm is brought to rest:
the law would go on with the model of another pose, or the arm cannot stand where it is led.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from flexarm_controller.answer import Outgoing
from flexarm_controller.exchange import REFUSED, ControllerExchange
from flexarm_controller.limits import limits_of
from flexarm_controller.motion.conversions import (
    cancel_response,
    goal_from_request,
    move_response,
    progress_to_msg,
)
from flexarm_controller.motion.led_arm import LedArm
from flexarm_controller.motion.models_awaited import ModelsAwaited
from flexarm_controller.motion.motion_server import Answer, MotionServer
from flexarm_controller.motion.progress import Progress
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.motion.tip_kinematics import TipKinematics
from flexarm_model.conversions import stamp_to_ns
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.process.beside import Thoughts, WorkLost, at_once
from flexarm_model.served.parameter_watch import PARAMETER_STEP, ParameterWatch

TRIES = 4  # to plan a motion in time
MORE, MOST_AHEAD = 1.5, 2.0  # of the time of the last plan, for the next; s


class MotionExchange:
    """Owns the motion server of one controller.

    Attributes:
        arm: The manipulator.
        has_models: Whether somebody makes the models of motions, and says so.
        ahead: Time that the next plan is given [s]; none where no state comes while it is made.
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
        exchange.loads = self._server.planner.loads
        self._models = ModelsAwaited()
        self.ahead = 0.0
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
            self._server.planner.lead(self._parameters.used)
            self._exchange.loads = self._server.planner.loads

    def on_models(self, text: str) -> list[Outgoing]:
        """Hear what the model node says of a reference: "stamp: receipt" or "stamp: refused: reason"."""
        self._models.hear(text)
        return self._give_up()

    def on_move_tip(self, request: Any) -> tuple[Any, list[Outgoing]]:
        """Answer a goal; returns the response and what is to be sent."""
        return at_once(self.moving_tip(request), self._server.planner.plan)

    def moving_tip(self, request: Any) -> Thoughts[tuple[Any, list[Outgoing]]]:
        """Do the same while the loop goes on: it may plan again if that took longer than was thought."""
        try:
            goal = goal_from_request(request)
            for _ in range(TRIES):
                arm = self._arm_or_refuse()
                followed = arm.reference
                draft = self._server.draft(goal, arm, arm.state, self.ahead)
                plan = yield draft
                if isinstance(plan, MotionError):
                    raise plan
                begun, arm = arm.state.t, self._arm_or_refuse()
                took = arm.state.t - begun
                if self._server.fits(draft, followed, arm, arm.state):
                    self.ahead = max(MORE * took, 0.0)
                    answer = self._server.take(draft, plan, arm, arm.state)
                    return move_response(answer), [*self._sent(arm, self.has_models()), *self._told(arm)]
                self.ahead = min(max(2.0 * took, self.ahead), MOST_AHEAD)
            raise MotionError(
                f"planned {TRIES} times; each time the arm was led elsewhere, or it took too long"
            )
        except (MotionError, WorkLost) as error:
            why = str(error)
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

    def _sent(self, arm: LedArm, is_awaited: bool = False) -> list[Outgoing]:
        """Return the references that an arm has taken, and what was said; those to rest need no models."""
        for out in arm.sent:
            if out.topic == "reference":
                self._models.follow(stamp_to_ns(out.msg.header.stamp), is_awaited)
        return arm.sent

    def _told(self, arm: LedArm) -> list[Outgoing]:
        return _said(self._server.update(arm, arm.state), arm)

    def _arm_or_refuse(self) -> LedArm:
        """Return the same; raises why nothing may move."""
        if isinstance(arm := self._arm(), str):
            raise MotionError(arm)
        return arm

    def _arm(self, is_armed: bool = False) -> LedArm | str:
        """Return the controller as what follows references, or why nothing may move."""
        exchange = self._exchange
        if exchange.controller is None:
            return exchange.model_fault
        if exchange.state is None or exchange.epoch_ns is None:
            return "no state yet"
        if not is_armed and exchange.guard.fault:
            return exchange.guard.fault
        return LedArm(exchange, exchange.state, self._names, exchange.epoch_ns)


def _nobody() -> bool:
    return False


def _said(told: Sequence[Progress], arm: LedArm) -> list[Outgoing]:
    return [Outgoing("motion_status", progress_to_msg(item, arm.epoch_ns)) for item in told]
