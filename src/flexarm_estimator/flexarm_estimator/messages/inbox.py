"""Messages that wait for the next step: read all at once, and what cannot be used is told by name.

A node that is late finds the messages of several periods at once, topic by topic: what a sensor said after
the period of the step waits for its own. Its stamp is in the future when the clock says so, or when it is of
before the clock was set back.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from flexarm_estimator.measurement import Measurement
from flexarm_estimator.messages.applied_torque import AppliedTorque, Torque
from flexarm_estimator.messages.readings import Refusal
from flexarm_estimator.messages.sensor_messages import SensorReader
from flexarm_model.conversions import NS_PER_S, stamp_to_ns
from flexarm_model.manipulator.description import ManipulatorConfig

TORQUE_TOPIC = "applied_effort"
_END_NS = (2**31 - 1) * NS_PER_S  # stamps end a second later; what is told of one is rounded
_MOST_WAITING = 1000  # messages between two steps; a flood drops the oldest
_LATEST_NS = NS_PER_S  # that a step may be behind; what is farther ahead is of before the clock was set back


@dataclass(frozen=True)
class Mail:
    """What waited.

    Attributes:
        samples: Of any sensor, age and order.
        refusals: What could not be used, by sensor or topic.
    """

    samples: list[Measurement]
    refusals: list[Refusal]


class Inbox:
    """Keeps sensor messages and torques until a step.

    Attributes:
        torque: Which torque acts when, of what was read.
        clock: Tells the time [ns], for messages that are ahead of a step; None where there is no clock.
    """

    def __init__(self, config: ManipulatorConfig, is_live: bool) -> None:
        """Start empty.

        Args:
            config: The manipulator.
            is_live: Stamps come from a clock; one of zero was forgotten by a driver.
        """
        self._reader, self._is_live = SensorReader(config), is_live
        self._waiting: deque[tuple[str, Any]] = deque(maxlen=_MOST_WAITING)
        self.clock: Callable[[], int] | None = None
        self.torque = AppliedTorque([axis.effort for axis in config.actuated.values()])

    @property
    def topics(self) -> tuple[str, ...]:
        """Relative topics whose messages can be read."""
        return (*self._reader.topics, TORQUE_TOPIC)

    def add(self, topic: str, msg: Any) -> None:
        """Keep a message of a sensor, or the torque that was applied."""
        self._waiting.append((topic, msg))

    def clear(self) -> None:
        """Forget what waits."""
        self._waiting.clear()

    def refuse_stamp(self, topic: str, stamp_ns: int) -> Refusal | None:
        """Return why a stamp [ns] cannot be one; None when it can."""
        if self._is_live <= stamp_ns < _END_NS:
            return None
        return Refusal(f"{topic}_timestamp", f"stamp is {stamp_ns} ns")

    def read(self, epoch_ns: int, step_ns: int) -> Mail:
        """Read what waits for a step at ``step_ns`` [ns]; times count from ``epoch_ns`` [ns]."""
        mail, early = Mail([], []), list[tuple[str, Any]]()
        for topic, msg in self._waiting:
            stamp_ns = stamp_to_ns(msg.header.stamp)
            if (refusal := self.refuse_stamp(topic, stamp_ns)) is not None:
                mail.refusals.append(refusal)
            elif step_ns < stamp_ns <= step_ns + _LATEST_NS and self.clock and stamp_ns <= self.clock():
                early.append((topic, msg))
            elif topic == TORQUE_TOPIC:
                mail.refusals.extend(self._take_torque(msg, stamp_ns))
            else:
                reading = self._reader.read(topic, msg, (stamp_ns - epoch_ns) * 1e-9)
                mail.samples.extend(reading.samples)
                mail.refusals.extend(reading.refusals)
                if topic == "joint_states" and len(msg.effort):
                    self.torque.measure(self._reader.read_torque(topic, msg)[0])
        self._waiting.clear()
        self._waiting.extend(early)
        return mail

    def _take_torque(self, msg: Any, stamp_ns: int) -> list[Refusal]:
        tau, refusals = self._reader.read_torque(TORQUE_TOPIC, msg)
        if tau is not None:
            self.torque.tell(Torque(stamp_ns, tau))
        return refusals
