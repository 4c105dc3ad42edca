"""A modal test between messages: every state of the drives is answered with a torque.

What is added belongs to an instant, not to a message: a state that was missed shifts nothing. While the test
thinks (predictions, verdicts) the arm is held; in real time a thread thinks, since a guard that hears nothing
for 50 ms stops the arm.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.excite.drive import Driven, channels
from flexarm_bringup.excite.held_arm import HeldArm
from flexarm_bringup.excite.measure import MeasuredTest, SensorCheckError, modal_test
from flexarm_bringup.excite.plan import Plan
from flexarm_bringup.excite.told import ToldTest
from flexarm_bringup.identify.measurement import SourceError
from flexarm_estimator.messages.inbox import TORQUE_TOPIC
from flexarm_estimator.messages.sensor_messages import SensorReader
from flexarm_model.conversions import NS_PER_S, stamp_to_ns
from flexarm_model.process.punctual import be_ordinary

Array = NDArray[np.float64]
TAIL = 20  # periods after a stretch in which late samples may come


class LiveTest:
    """Holds the arm and excites it.

    Attributes:
        told: What is to be told of it; None until it has ended.
        failure: Why it cannot go on; empty while it can.
    """

    def __init__(
        self,
        arm: HeldArm,
        plan: Plan,
        ignore: Sequence[str],
        say: Callable[[str], None],
        is_lockstep: bool = False,
    ) -> None:
        """Prepare the first stretch.

        Args:
            arm: That is held.
            plan: What to do.
            ignore: Channels or sensors to leave out.
            say: Is told what is being done, perhaps by another thread.
            is_lockstep: Time waits for thoughts.

        Raises:
            SourceError: A channel that is to be left out does not exist.
        """
        self.arm, self._plan, self._ignored = arm, plan, tuple(ignore)
        self.told: ToldTest | None = None
        self.failure = ""
        self._period_ns = round(arm.dt * NS_PER_S)
        self._reader, self._channels = SensorReader(arm.config), channels(arm.config)
        self._first = {channel.spec.name: i for i, channel in reversed([*enumerate(self._channels)])}
        self._steps = modal_test(arm, plan, ignore, say)
        self._pool = None if is_lockstep else ThreadPoolExecutor(1, initializer=be_ordinary)
        self._thought: Future[Array | MeasuredTest] | None = None
        self._starts: list[int] = []
        self._start_ns: int | None = None
        self._begin(next(self._steps))

    @property
    def has_ended(self) -> bool:
        """Whether nothing more is to be excited."""
        return self.told is not None or bool(self.failure)

    def answer(self, stamp_ns: int, theta: Array, theta_dot: Array) -> tuple[Array, Array]:
        """Return the torque for a state of the drives, and the part of it that excites.

        Args:
            stamp_ns: Of the state; the torque acts a period later [ns].
            theta: Actuated axes [rad or m], (n_theta,).
            theta_dot: Their velocity, (n_theta,).

        Returns:
            Torque [N m or N], twice (n_theta,).
        """
        added = self._next(stamp_ns + self._period_ns)
        return self.arm.torque(theta, theta_dot) + added, added

    @property
    def topics(self) -> tuple[str, ...]:
        """Relative topics that carry the arm's sensors."""
        return self._reader.topics

    def on_sensor(self, topic: str, msg: Any) -> None:
        """Take the samples of a message."""
        row = self._row(stamp_to_ns(msg.header.stamp))
        for sample in self._reader.read(topic, msg, 0.0).samples:
            first = self._first.get(sample.sensor)
            if first is not None and 0 <= row < len(self._y):
                self._y[row, first : first + sample.y.size] = sample.y

    def on_torque(self, msg: Any) -> None:
        """Take the torque that acts from the stamp of a message on."""
        row = self._row(stamp_to_ns(msg.header.stamp))
        tau, _ = self._reader.read_torque(TORQUE_TOPIC, msg)
        if tau is not None and 0 <= row < len(self._tau):
            self._tau[row:] = tau  # until the next one

    def close(self) -> None:
        """End the thinking."""
        if self._pool is not None:
            self._pool.shutdown(wait=True, cancel_futures=True)

    def _row(self, stamp_ns: int) -> int:
        return round((stamp_ns - self._start_ns) / self._period_ns) if self._start_ns is not None else -1

    def _next(self, at_ns: int) -> Array:
        """Return what is added from an instant on; goes on to the next stretch when one is over."""
        if not self.has_ended and self._thought is not None and self._thought.done():
            self._take_thought(self._thought)
        none = np.zeros(self.arm.model.n_theta)
        if self.has_ended or self._thought is not None:
            return none
        if self._start_ns is None:
            self._start_ns = at_ns
            self._starts.append(at_ns)
        row = self._row(at_ns)
        if row >= len(self._added) + TAIL:
            self._think(Driven(self._tau, self._added, self._y))
        return self._added[row] if 0 <= row < len(self._added) else none

    def _think(self, driven: Driven) -> None:
        if self._pool is not None:
            self._thought = self._pool.submit(self._go_on, driven)
        else:
            self._thought = Future()
            try:
                self._thought.set_result(self._go_on(driven))
            except SourceError as error:
                self._thought.set_exception(error)

    def _go_on(self, driven: Driven) -> Array | MeasuredTest:
        try:
            return self._steps.send(driven)
        except StopIteration as end:
            tested: MeasuredTest = end.value
            return tested

    def _take_thought(self, thought: Future[Array | MeasuredTest]) -> None:
        self._thought = None
        try:
            found = thought.result()
        except SensorCheckError as error:
            self.told = ToldTest(self._plan, error.findings, self._ignored, (), str(error))
            self.failure = str(error)
        except SourceError as error:
            self.failure = str(error)
        else:
            if isinstance(found, MeasuredTest):
                runs = tuple(self._starts[-len(self._plan.signs) :])
                self.told = ToldTest(self._plan, found.findings, self._ignored, runs)
            else:
                self._begin(found)

    def _begin(self, added: Array) -> None:
        """Be ready for a stretch; it starts with the next state."""
        self._added, self._start_ns = added, None
        self._y = np.full((len(added), len(self._channels)), np.nan)
        self._tau = np.zeros_like(added)
