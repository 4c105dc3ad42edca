"""The test stand at message level: the record as ROS messages, through all that stands before the filter."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import Any, Protocol

from flexarm_bringup.fault_drill.motion_record import DrilledArm, MotionRecord
from flexarm_bringup.sim.conversions import Outgoing, applied_effort_msg, samples_to_msgs
from flexarm_bringup.sim.sample import Sample
from flexarm_estimator.estimate import Estimate
from flexarm_estimator.exchange import EstimatorExchange
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.conversions import floats, model_to_msg

EPOCH_NS = 1_700_000_000_000_000_000
Tamper = Callable[[int, list[Outgoing]], list[Outgoing]]
Clock = Callable[[float], float]


class Recorded(Protocol):
    """A machine whose motion was recorded: a ``Stand``."""

    @property
    def arm(self) -> DrilledArm:
        """The machine."""
        ...

    @property
    def settings(self) -> EstimatorConfig:
        """Of the estimator."""
        ...

    @property
    def record(self) -> MotionRecord:
        """What it did."""
        ...


class Link(Protocol):
    """The estimator at the other end of its messages."""

    @property
    def newest_only(self) -> tuple[str, ...]:
        """Relative topics of which it need not take a message when a newer one has come."""
        ...

    def send_model(self, msg: Any) -> None:
        """Serve a model."""
        ...

    def send(self, topic: str, msg: Any) -> None:
        """Say something on a relative topic."""
        ...

    def estimate(self, stamp_ns: int) -> Estimate:
        """Return what the estimator says of an instant, all of whose messages have been sent."""
        ...

    def diagnostics(self, stamp_ns: int) -> Any:
        """Return its DiagnosticArray of now."""
        ...


class ExchangeLink:
    """The estimator in this process."""

    newest_only = ()

    def __init__(self, stand: Recorded) -> None:
        """Start without a model."""
        self._exchange = EstimatorExchange(stand.arm.config, stand.settings, None)

    def send_model(self, msg: Any) -> None:
        """See Link."""
        self._exchange.on_model(msg)

    def send(self, topic: str, msg: Any) -> None:
        """See Link."""
        self._exchange.on_sensor(topic, msg)

    def estimate(self, stamp_ns: int) -> Estimate:
        """See Link."""
        self._exchange.step(stamp_ns)
        assert self._exchange.estimate is not None
        return self._exchange.estimate

    def diagnostics(self, stamp_ns: int) -> Any:
        """See Link."""
        return self._exchange.diagnostics(stamp_ns)


@dataclass(frozen=True)
class MessageTrace:
    """What came out.

    Attributes:
        estimates: Of every tick.
        diagnostics: Texts at the time asked for, by level.
        noted: Refusals that concern no sensor, by topic.
        newest_only: See Link.
    """

    estimates: tuple[Estimate, ...]
    diagnostics: dict[bytes, list[str]]
    noted: dict[str, int]
    newest_only: tuple[str, ...] = ()

    def accepted(self, k: int, sensor: str) -> int:
        """Return how many samples of a sensor had been fused at tick ``k``."""
        return next(r.accepted for r in self.estimates[k].sensors if r.name == sensor)

    def refused(self, topic: str, sensors: Collection[str]) -> int:
        """Return the refusals of topics that begin so, and of the sensors that they tell of."""
        noted = sum(count for source, count in self.noted.items() if source.startswith(topic))
        return noted + sum(report.rejected for report in self.estimates[-1].sensors if report.name in sensors)


class MessageStand:
    """A stand whose samples travel as messages."""

    def __init__(self, stand: Recorded, make_link: Callable[[Recorded], Link] = ExchangeLink) -> None:
        """Use the record of a stand; ``make_link`` starts an estimator for every run."""
        self._stand, self._make_link = stand, make_link

    def play(self, tamper: Tamper, told_at: float, clock: Clock = float) -> MessageTrace:
        """Send the record to an estimator.

        Args:
            tamper: Changes the messages of a tick.
            told_at: When diagnostics are read [s].
            clock: Time of all stamps as a function of that of the record [s].
        """
        record, link = self._stand.record, self._make_link(self._stand)
        link.send_model(model_to_msg(record.model))
        arriving = self._samples()
        estimates, told = [], {}
        stamps = [EPOCH_NS + round(1e9 * clock(float(t))) for t in record.t]
        for k, stamp_ns in enumerate(stamps):
            if k in record.served:
                link.send_model(model_to_msg(record.served[k], stamp_ns))
            for out in tamper(k, self._messages(k, arriving[k], stamps)):
                link.send(out.topic, out.msg)
            estimates.append(link.estimate(stamp_ns))
            if k == round(told_at / record.dt):
                told = _by_level(link.diagnostics(stamp_ns))
        noted = _noted(link.diagnostics(stamps[-1]))
        return MessageTrace(tuple(estimates), told, noted, link.newest_only)

    def _samples(self) -> list[list[Sample]]:
        arriving: list[list[Sample]] = [[] for _ in self._stand.record.t]
        for arrival in self._stand.record.arrivals:
            arriving[arrival.tick].append(arrival.sample)
        return arriving

    def _messages(self, k: int, samples: list[Sample], stamps: list[int]) -> list[Outgoing]:
        """Return the messages of a tick; the joint states, which make the estimator step, come last."""
        config, record = self._stand.arm.config, self._stand.record
        site = {spec.name: spec.site for spec in config.sensors}
        angles = {site[s.sensor]: float(s.y[0]) for s in samples if s.kind == "encoder"}
        axes, next_tau = list(config.actuated), record.tau[min(k + 1, len(record.tau) - 1)]
        told = applied_effort_msg(axes, floats(next_tau), stamps[k])
        joints = applied_effort_msg(axes, floats(record.tau[k]), stamps[k])
        joints.position = floats([angles.get(name, 0.0) for name in axes])
        sensors = samples_to_msgs(config, samples, stamps.__getitem__)
        return [*sensors, Outgoing("applied_effort", told), Outgoing("joint_states", joints)]


def _by_level(array: Any) -> dict[bytes, list[str]]:
    told: dict[bytes, list[str]] = {}
    for status in array.status:
        told.setdefault(status.level, []).append(f"{status.name}: {status.message}")
    return told


def _noted(array: Any) -> dict[str, int]:
    """Return the refusals of sources that are no sensors."""
    told = ((status.name.split(": ")[1], pair) for status in array.status for pair in status.values)
    return {source: int(pair.value) for source, pair in told if pair.key == "refused"}
