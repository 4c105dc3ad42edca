"""States and tips as the bytes of their messages: see ``flexarm_model.ros.message_writer``."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

from flexarm_estimator.conversions import (
    STATE_NUMBERS,
    state_numbers,
    state_to_msg,
    tip_numbers,
    tip_to_msg,
)
from flexarm_estimator.estimate import Estimate
from flexarm_model.ros.message_writer import STAMP, MessageWriter, Serialise, stamp_values
from flexarm_model.served.reduced_model import ReducedModel

_OF_SENSOR = ("age", "accepted", "rejected", "innovation", "normalised_innovation")
_POSE, _TWIST = "pose.pose", "twist.twist"
_TIP = (
    *(f"{_POSE}.position.{axis}" for axis in "xyz"),
    *(f"{_POSE}.orientation.{axis}" for axis in "xyzw"),
    "pose.covariance",
    *(f"{_TWIST}.{part}.{axis}" for part in ("linear", "angular") for axis in "xyz"),
    "twist.covariance",
)


class StateWriter:
    """Writes what one estimator tells."""

    def __init__(self, serialise: Serialise) -> None:
        """Know no message yet; ``serialise`` writes any."""
        self._serialise = serialise
        self._states: MessageWriter | None = None  # once it is known how many sensors there are
        self._tips = MessageWriter((*STAMP, *_TIP), serialise)

    def state(self, estimate: Estimate, model: ReducedModel, stamp_ns: int) -> Any:
        """Return the bytes, at first the message, of what ``conversions.state_to_msg`` makes of it."""
        numbers, sensors = state_numbers(estimate), estimate.sensors
        key = (
            estimate.model_id, estimate.status, estimate.reason, *map(len, numbers), model.theta_names,
            model.eta_names, estimate.layout.biases, *((s.name, s.status, s.reason) for s in sensors),
            *(len(s.innovation) for s in sensors),
        )  # fmt: skip
        values: list[Sequence[Any]] = [*stamp_values(stamp_ns), (estimate.age,), *numbers]
        for s in sensors:
            values += (s.age,), (s.accepted,), (s.rejected,), s.innovation.tolist(), (s.normalised,)
        make = partial(state_to_msg, estimate, model, stamp_ns)
        return self._writer(len(sensors)).write(key, values, make)

    def tip(self, estimate: Estimate, stamp_ns: int) -> Any:
        """Return the bytes, at first the message, of what ``conversions.tip_to_msg`` makes of it."""
        position, orientation, cov_pose, twist, cov_twist = tip_numbers(estimate)
        one_each = [(number,) for number in (*position, *orientation)]
        values = [*stamp_values(stamp_ns), *one_each, cov_pose, *((v,) for v in twist), cov_twist]
        return self._tips.write("tip", values, partial(tip_to_msg, estimate, stamp_ns))

    def _writer(self, count: int) -> MessageWriter:
        """Return the writer of the states of an arm with so many sensors."""
        if self._states is None:
            of_sensors = (f"sensors.{i}.{field}" for i in range(count) for field in _OF_SENSOR)
            self._states = MessageWriter((*STAMP, "age", *STATE_NUMBERS, *of_sensors), self._serialise)
        return self._states
