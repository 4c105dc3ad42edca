"""What the controller tells of its answers beside the command: status, and what it expects of the plan.

To make a status, to send it and to hear that it has arrived takes the processor 0.1 ms, at 500 Hz a twentieth
of the period, and nobody steers by it. So every change is told, and else so many a second. Decided by stamps
alone, so that a replay tells the same.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

from flexarm_controller.command import ControlCommand
from flexarm_controller.conversions import (
    debug_to_msg,
    gains_to_msg,
    notice_msg,
    predicted_to_msg,
    status_to_msg,
)
from flexarm_controller.debug import Insight
from flexarm_controller.state import ArmState
from flexarm_model.conversions import ns_to_stamp
from flexarm_model.served.reduced_model import ReducedModel

MOST_RATE = 200.0  # Hz; as often as an arm of that control rate needs to tell every answer
GAP_NS = 50_000_000  # between two predicted motions, 20 a second
EARLY = 0.25  # periods by which a stamp may be early


@dataclass(frozen=True)
class Outgoing:
    """A message and the relative topic it goes to."""

    topic: str
    msg: Any


class Answer(NamedTuple):  # not a dataclass: one is made in every period
    """What became of a state.

    Attributes:
        stamp_ns: Of the state [ns].
        mode: Rung of the ladder, or "inactive".
        reason: Of the mode.
        command: None where none was sent.
        missed_cycles: Control periods without an answer so far [1].
        overruns: Answers so far that took longer than the time budget [1].
        notice: What became of a reference meanwhile; mostly empty.
        is_left: The arm is left to the guard, which is to stop it.
    """

    stamp_ns: int
    mode: str
    reason: str
    command: ControlCommand | None = None
    missed_cycles: int = 0
    overruns: int = 0
    notice: str = ""
    is_left: bool = False

    @property
    def solve_time(self) -> float:
        """CPU time of the whole step [s]."""
        return 0.0 if self.command is None else self.command.solve_time


class AnswerTeller:
    """Tells of the answers of one controller.

    Attributes:
        write_status: Makes of command, missed cycles, overruns and stamp [ns] what is published of an answer.
    """

    def __init__(self, period: float, backend: str, is_live: bool) -> None:
        """Tell the first one.

        Args:
            period: Of the controller [s].
            backend: Of the solver.
            is_live: Stamps come from a clock; else, in lockstep, the status of every answer is told.
        """
        self._backend, self._gap_ns = backend, 1e9 * (1.0 / MOST_RATE - EARLY * period) if is_live else 0.0
        self._said, self._said_ns = ("", ""), 0
        self._insight: Insight | None = None
        self._listens: Callable[[str], bool] = lambda topic: False
        self._predicted_ns = -math.inf
        self.write_status: Callable[[ControlCommand, int, int, int], Any] = status_to_msg

    def tell_more(self, insight: Insight, listens: Callable[[str], bool]) -> None:
        """Tell from now on what is told only while somebody listens; by topic, see ``look_ahead``."""
        self._insight, self._listens = insight, listens

    def tell(self, answer: Answer) -> list[Outgoing]:
        """Return the status of an answer if it is due, and before it what else there is to tell."""
        noted = [_notice(answer, answer.notice)] if answer.notice else []
        return noted + self._status(answer)

    def _status(self, answer: Answer) -> list[Outgoing]:
        since_ns, said = answer.stamp_ns - self._said_ns, (answer.mode, answer.reason)
        if said == self._said and 0 <= since_ns < self._gap_ns:
            return []
        self._said, self._said_ns = said, answer.stamp_ns
        if answer.command is None:
            return [_notice(answer, answer.reason)]
        msg = self.write_status(answer.command, answer.missed_cycles, answer.overruns, answer.stamp_ns)
        return [Outgoing("controller_status", msg)]

    def look_ahead(self, answer: Answer, model: ReducedModel, state: ArmState) -> list[Outgoing]:
        """Return what the plan of an answer leads to, where somebody wants to know.

        Args:
            answer: With a command.
            model: In use.
            state: That is answered.
        """
        command, insight = answer.command, self._insight
        if command is None or insight is None:
            return []
        told = [
            *self._gains(command, model, answer.stamp_ns),
            *self._predicted(insight, answer, model, state),
        ]
        if self._listens("controller_debug"):
            expected = insight.look(model, state, command)
            msg = debug_to_msg(command, expected, insight.period, self._backend, model.eta_names)
            msg.header.stamp = ns_to_stamp(answer.stamp_ns)
            told.append(Outgoing("controller_debug", msg))
        return told

    def _gains(self, command: ControlCommand, model: ReducedModel, stamp_ns: int) -> list[Outgoing]:
        """Return the law about the states that a command leads through, where the law can tell."""
        if command.local is None or not self._listens("feedback_gains"):
            return []
        msg = gains_to_msg(command, command.local(), model.theta_names, model.eta_names, stamp_ns)
        return [Outgoing("feedback_gains", msg)]

    def _predicted(
        self, insight: Insight, answer: Answer, model: ReducedModel, state: ArmState
    ) -> list[Outgoing]:
        """Return the motion that a plan leads to, so many times a second."""
        since_ns = answer.stamp_ns - self._predicted_ns
        if 0 <= since_ns < GAP_NS or not self._listens("predicted") or answer.command is None:
            return []
        states = insight.states(model, state, answer.command)
        if not len(states):
            return []
        self._predicted_ns = answer.stamp_ns
        msg = predicted_to_msg(answer.command, states, model.theta_names, insight.period, answer.stamp_ns)
        return [Outgoing("predicted", msg)]


def _notice(answer: Answer, text: str) -> Outgoing:
    """Return a status that says something beside an answer, or in the place of one."""
    msg = notice_msg(text, answer.stamp_ns, answer.missed_cycles, answer.overruns)
    return Outgoing("controller_status", msg)
