"""The test stand at message level: the record as ROS messages, through all that stands before the filter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from flexarm_bringup.fault_drill.stand import Stand
from flexarm_bringup.sim.conversions import Outgoing, applied_effort_msg, samples_to_msgs
from flexarm_bringup.sim.sensor_simulator import Sample
from flexarm_estimator.estimate import Estimate
from flexarm_estimator.exchange import EstimatorExchange
from flexarm_model.conversions import floats, model_to_msg

EPOCH_NS = 1_700_000_000_000_000_000
ERROR, WARN = b"\x02", b"\x01"  # levels of diagnostics
Tamper = Callable[[int, list[Outgoing]], list[Outgoing]]


@dataclass(frozen=True)
class MessageTrace:
    """What came out.

    Attributes:
        estimates: Of every tick.
        diagnostics: Texts of one tick by level.
        noted: Refusals that concern no sensor.
    """

    estimates: tuple[Estimate, ...]
    diagnostics: dict[bytes, list[str]]
    noted: int

    def accepted(self, k: int, sensor: str) -> int:
        """Return how many samples of a sensor had been fused at tick ``k``."""
        return next(r.accepted for r in self.estimates[k].sensors if r.name == sensor)

    def refused(self) -> int:
        """Return all refusals."""
        return self.noted + sum(report.rejected for report in self.estimates[-1].sensors)


class MessageStand:
    """A stand whose samples travel as messages."""

    def __init__(self, stand: Stand) -> None:
        """Use the record of a stand."""
        self._stand = stand
        self._period_ns = round(1e9 * stand.record.dt)

    def stamp_of(self, tick: int) -> int:
        """Return the stamp of a tick [ns]."""
        return EPOCH_NS + tick * self._period_ns

    def play(self, tamper: Tamper, told_at: float) -> MessageTrace:
        """Run the exchange over the record.

        Args:
            tamper: Changes the messages of a tick.
            told_at: When diagnostics are read [s].
        """
        stand, record = self._stand, self._stand.record
        exchange = EstimatorExchange(stand.arm.config, stand.settings, None)
        exchange.on_model(model_to_msg(record.model))
        arriving = self._samples()
        estimates, told = [], {}
        for k in range(len(record.t)):
            if k in record.served:
                exchange.on_model(model_to_msg(record.served[k], self.stamp_of(k)))
            for out in tamper(k, self._messages(k, arriving[k])):
                exchange.on_sensor(out.topic, out.msg)
            exchange.step(self.stamp_of(k))
            assert exchange.estimate is not None
            estimates.append(exchange.estimate)
            if k == round(told_at / record.dt):
                told = _by_level(exchange.diagnostics(self.stamp_of(k)))
        noted = sum(sum(reasons.values()) for reasons in exchange.notes.counts.values())
        return MessageTrace(tuple(estimates), told, noted)

    def _samples(self) -> list[list[Sample]]:
        arriving: list[list[Sample]] = [[] for _ in self._stand.record.t]
        for arrival in self._stand.record.arrivals:
            arriving[arrival.tick].append(arrival.sample)
        return arriving

    def _messages(self, k: int, samples: list[Sample]) -> list[Outgoing]:
        config, record = self._stand.arm.config, self._stand.record
        site = {spec.name: spec.site for spec in config.sensors}
        angles = {site[s.sensor]: float(s.y[0]) for s in samples if s.kind == "encoder"}
        axes, next_tau = list(config.actuated), record.tau[min(k + 1, len(record.tau) - 1)]
        joints = applied_effort_msg(axes, floats(record.tau[k]), self.stamp_of(k))
        joints.position = floats([angles.get(name, 0.0) for name in axes])
        told = applied_effort_msg(axes, floats(next_tau), self.stamp_of(k))
        sensors = samples_to_msgs(config, samples, self.stamp_of)
        return [*sensors, Outgoing("joint_states", joints), Outgoing("applied_effort", told)]


def _by_level(array: Any) -> dict[bytes, list[str]]:
    told: dict[bytes, list[str]] = {}
    for status in array.status:
        told.setdefault(status.level, []).append(f"{status.name}: {status.message}")
    return told
