"""Feeds the records of a bag through estimator and controller, in the order of the bag.

The same exchanges that the nodes connect to DDS are connected to each other here. In a lockstep bag
the estimator acts at every tick, in a real-time bag at every joint_states message; the controller
answers every modal_state. There is no clock: a bag played twice gives the same messages.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, Protocol

from flexarm_bringup.bag_reader import Record
from flexarm_bringup.conversions import deserialise
from flexarm_bringup.topics import find_stream
from flexarm_model.conversions import stamp_to_ns


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

    def on_guard_status(self, msg: Any) -> None:
        """Take the session."""
        ...

    def on_modal_state(self, msg: Any) -> Iterable[Outgoing]:
        """Answer a state."""
        ...


class Player:
    """Plays records; state lives in the two exchanges."""

    def __init__(self, estimator: EstimatorSide, controller: ControllerSide, lockstep: bool) -> None:
        self._estimator, self._controller = estimator, controller
        self._trigger = "tick" if lockstep else "joint_states"

    def play(self, records: Iterable[Record]) -> Iterator[tuple[Record, Outgoing]]:
        """Return every message that the two nodes would send, with the record that caused it."""
        for record in records:
            for outgoing in self._feed(record):
                yield record, outgoing

    def _feed(self, record: Record) -> Iterator[Outgoing]:
        stream = find_stream(record.name)
        topic = stream.topic if stream else ""
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
            self._controller.on_guard_status(msg)
        elif topic == self._trigger:
            yield from self._answer(self._estimator.step(stamp_to_ns(msg.header.stamp)))

    def _answer(self, outgoings: Iterable[Outgoing]) -> Iterator[Outgoing]:
        for outgoing in outgoings:
            yield outgoing
            if outgoing.topic == "modal_state":
                yield from self._controller.on_modal_state(outgoing.msg)
