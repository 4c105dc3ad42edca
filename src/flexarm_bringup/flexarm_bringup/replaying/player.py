"""Feeds the records of a bag through estimator and controller, in the order of the bag.

The same exchanges that the nodes connect to DDS are connected to each other here. In a lockstep bag
the estimator acts at every tick, in a real-time bag at every joint_states message; the controller
answers every modal_state. There is no clock: a bag played twice gives the same messages.

An intervention acts from the first step after its stamp on, but a recorder may have received that step before
it: the player looks a little ahead for interventions.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Protocol

from flexarm_bringup.bags.bag_reader import Record
from flexarm_bringup.bags.cdr import header_stamp_ns
from flexarm_bringup.conversions import deserialise
from flexarm_bringup.topics import find_stream
from flexarm_model.conversions import stamp_to_ns

INTERVENTIONS = "estimator/interventions"
LOOK_AHEAD = 1000  # records


class Outgoing(Protocol):
    """A message and the relative topic it goes to."""

    @property
    def topic(self) -> str:
        """Relative topic."""
        ...

    @property
    def msg(self) -> Any:
        """The message."""
        ...


class EstimatorSide(Protocol):
    """What the player needs of the estimator."""

    def on_model(self, msg: Any) -> Iterable[Outgoing]:
        """Take a model or refuse it."""
        ...

    def on_sensor(self, topic: str, msg: Any) -> None:
        """Take a message of a sensor, or the torque that was applied."""
        ...

    def on_intervention(self, msg: Any) -> None:
        """Take what a user did."""
        ...

    def step(self, stamp_ns: int) -> Iterable[Outgoing]:
        """Fuse what was taken and tell the state at a stamp [ns]."""
        ...


class ControllerSide(Protocol):
    """What the player needs of the controller."""

    def on_model(self, msg: Any) -> Iterable[Outgoing]:
        """Take a model or refuse it."""
        ...

    def on_reference(self, msg: Any) -> Iterable[Outgoing]:
        """Take a reference or refuse it."""
        ...

    def on_guard_status(self, msg: Any) -> Iterable[Outgoing]:
        """Take the session."""
        ...

    def on_modal_state(self, msg: Any) -> Iterable[Outgoing]:
        """Answer a state."""
        ...

    def work_ahead(self) -> None:
        """Do what the node does when the answer is out."""
        ...


class Player:
    """Plays records; state lives in the two exchanges."""

    def __init__(self, estimator: EstimatorSide, controller: ControllerSide, lockstep: bool) -> None:
        self._estimator, self._controller = estimator, controller
        self._trigger = "tick" if lockstep else "joint_states"
        self._ahead: deque[tuple[int, Record]] = deque()

    def play(self, records: Sequence[Record]) -> Iterator[tuple[Record, Outgoing]]:
        """Return every message that the two nodes would send, with the record that caused it."""
        self._ahead.extend(item for item in enumerate(records) if _topic(item[1]) == INTERVENTIONS)
        for index, record in enumerate(records):
            for outgoing in self._feed(index, record):
                yield record, outgoing

    def _feed(self, index: int, record: Record) -> Iterator[Outgoing]:
        stream, topic = find_stream(record.name), _topic(record)
        is_sensor = stream is not None and stream.is_sensor
        if not (is_sensor or topic in ("model", "reference", "guard_status", "tick")):
            return
        msg = deserialise(record.cdr, record.type)
        if is_sensor:
            self._estimator.on_sensor(topic, msg)
        if topic == "model":
            yield from self._estimator.on_model(msg)
            yield from self._controller.on_model(msg)
        elif topic == "reference":
            yield from self._controller.on_reference(msg)
        elif topic == "guard_status":
            yield from self._controller.on_guard_status(msg)
        elif topic == self._trigger:
            stamp_ns = stamp_to_ns(msg.header.stamp)
            self._intervene(index, stamp_ns)
            yield from self._answer(self._estimator.step(stamp_ns))

    def _intervene(self, index: int, stamp_ns: int) -> None:
        """Tell the estimator the interventions that act from the step at ``stamp_ns`` on."""
        while self._ahead and self._ahead[0][0] <= index + LOOK_AHEAD:
            at, record = self._ahead[0]
            if at > index and header_stamp_ns(record.cdr) >= stamp_ns:
                break
            self._estimator.on_intervention(deserialise(record.cdr, record.type))
            self._ahead.popleft()

    def _answer(self, outgoings: Iterable[Outgoing]) -> Iterator[Outgoing]:
        for outgoing in outgoings:
            yield outgoing
            if outgoing.topic == "modal_state":
                yield from self._controller.on_modal_state(outgoing.msg)
                self._controller.work_ahead()


def _topic(record: Record) -> str:
    stream = find_stream(record.name)
    return stream.topic if stream else ""
