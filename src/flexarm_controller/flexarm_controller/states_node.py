"""When the controller node answers a state, and hears of the guard.

Subscribes
    modal_state (flexarm_interfaces/ModalState), guard_status (flexarm_interfaces/GuardStatus: session),
    tick (flexarm_interfaces/Tick, lockstep only).

In lockstep a state is answered once everything that was announced for its instant is here, and with what the
guard had said by then: a rig that brakes waits for nobody, and may be ahead. A bag holds them in that order,
so a replay says the same. In real time only
the newest state is answered when several wait, and commands are at least half a period apart (``pacing``).
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from flexarm_interfaces.msg import GuardStatus, ModalState, Tick
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from flexarm_controller.pacing import Pacing
from flexarm_controller.told_state import SentState, ToldState
from flexarm_model.conversions import stamp_to_ns
from flexarm_model.ros.bytes_node import subscribe_bytes
from flexarm_model.ros.lockstep import Lockstep, Messages
from flexarm_model.ros.node import LOCKSTEP_QOS, NEWEST_QOS, RELIABLE_QOS

FARTHEST_AHEAD = 1000  # ticks without a state, after which the guard is heard all the same


@dataclass(frozen=True)
class Duties:
    """What is done with the messages.

    Attributes:
        join: Takes the session of the guard.
        answer: Sends a command for a state.
        work_ahead: Does what has time until the next state; called when the answer to this one is out.
    """

    join: Callable[[GuardStatus], None]
    answer: Callable[[ToldState], None]
    work_ahead: Callable[[], None]


class States(Protocol):
    """Takes states and sees that they are answered in time."""

    def on_state(self, told: ToldState) -> None:
        """Take a state that was sent, or handed over."""
        ...


class TickedStates:
    """States of the simulated rig in lockstep: none is skipped."""

    def __init__(self, node: Node, duties: Duties) -> None:
        """Subscribe."""
        self._duties = duties
        self._lockstep = Lockstep(("guard_status",), self._on_tick_complete)
        self._ticked_ns, self._heard = -1, deque[tuple[int, Sequence[GuardStatus]]]()
        self._waiting = deque[ToldState]()
        node.create_subscription(GuardStatus, "guard_status", self.on_guard_status, LOCKSTEP_QOS)
        node.create_subscription(
            ModalState, "modal_state", lambda msg: self.on_state(SentState(msg)), LOCKSTEP_QOS
        )
        node.create_subscription(Tick, "tick", self.on_tick, LOCKSTEP_QOS)

    def on_guard_status(self, msg: GuardStatus) -> None:
        """Keep the session token for the tick that announces it."""
        self._lockstep.add("guard_status", msg)

    def on_tick(self, msg: Tick) -> None:
        """Note what belongs to an instant."""
        self._lockstep.announce(msg.sequence, stamp_to_ns(msg.header.stamp), msg.topics, msg.counts)

    def on_state(self, told: ToldState) -> None:
        """Answer a state once everything of its instant is here."""
        while self._waiting and self._waiting[-1].stamp_ns > told.stamp_ns:
            self._waiting.pop()  # of before the clock was set back
        self._waiting.append(told)
        self._answer()

    def _on_tick_complete(self, stamp_ns: int, messages: Messages) -> None:
        """Keep what came with an instant, then answer its state if that is here."""
        self._heard.append((stamp_ns, messages.get("guard_status", ())))
        if len(self._heard) > FARTHEST_AHEAD:
            self._join(1)
        self._ticked_ns = stamp_ns
        self._answer()

    def _answer(self) -> None:
        while self._waiting and self._waiting[0].stamp_ns <= self._ticked_ns:
            told = self._waiting.popleft()
            ticks = [stamp_ns for stamp_ns, _ in self._heard]  # a clock may have been set back between them
            self._join(1 + ticks.index(told.stamp_ns) if told.stamp_ns in ticks else len(ticks))
            self._duties.answer(told)
            self._duties.work_ahead()

    def _join(self, count: int) -> None:
        """Take what the guard said with the oldest so many ticks."""
        for _ in range(count):
            for msg in self._heard.popleft()[1]:
                self._duties.join(msg)


class PacedStates:
    """States in real time: the newest is answered, and what was missed is skipped."""

    def __init__(self, node: Node, duties: Duties, period: float) -> None:
        """Subscribe; commands leave one per ``period`` [s]."""
        self._duties = duties
        self._waiting: ToldState | None = None
        self._pacing = Pacing(period, time.perf_counter)
        self._later = node.create_timer(1.0, self.on_later, clock=Clock(clock_type=ClockType.STEADY_TIME))
        self._later.cancel()
        node.create_subscription(GuardStatus, "guard_status", duties.join, RELIABLE_QOS)
        subscribe_bytes(
            node, ModalState, "modal_state", lambda msg: self.on_state(SentState(msg)), NEWEST_QOS
        )

    def on_state(self, told: ToldState) -> None:
        """Answer a state, or keep it until the next command may leave."""
        self._waiting = told
        if (wait := self._pacing.wait()) > 0.0:
            self._later.timer_period_ns = math.ceil(1e9 * wait)
            self._later.reset()
        else:
            self._answer()

    def on_later(self) -> None:
        """Answer the newest state after a late answer; a timer that was due twice calls too early, too."""
        self._later.cancel()
        if self._waiting is not None:
            self.on_state(self._waiting)

    def _answer(self) -> None:
        if self._waiting is not None:
            told, self._waiting = self._waiting, None
            self._duties.answer(told)
            self._pacing.note()
            self._duties.work_ahead()
