"""Stamps that lie anywhere in a period of the clock, scatter, drift or jump: the drift watch counts right."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from planar_strip import Record
from test_drift_exchange import NS, header, messages, model, record, started

from flexarm_estimator.drift.exchange import DriftExchange
from flexarm_estimator.drift.period_count import PeriodCount
from flexarm_model.served.reduced_model import ReducedModel

__all__ = ["model", "record"]  # fixtures
DAY = 86_400 * 10**9 // NS * NS
PPM = 1e-6


def restamped(exchange: DriftExchange, record: Record, stamp_ns: Callable[[int], int]) -> DriftExchange:
    """Feed a record; ``stamp_ns`` of an instant is asked for every message."""
    for k in range(len(record.t)):
        for topic, msg in messages(record, k):
            msg.header = header(stamp_ns(k), msg.header.frame_id)
            exchange.on_sensor(topic, msg)
    return exchange


@pytest.mark.parametrize(
    ("phase", "scatter", "drift"), [(0.5, 30e-6, 0.0), (0.5, 30e-6, 20 * PPM), (0.25, 1e-3, 0.0)]
)
def test_stamps_of_any_phase_tell_of_the_modes_as_those_in_step_do(
    model: ReducedModel, record: Record, phase: float, scatter: float, drift: float
) -> None:
    """At half a period every fourth sample was put upon its neighbour, and sigma was seven times that.

    Scatter is one sigma of 30 us, or a fifth of a period either way, which is all that is borne.
    """
    rng, in_step = np.random.default_rng(2), restamped(started(model), record, lambda k: k * NS).watch
    bounded = scatter >= 1e-3
    exchange = restamped(started(model), record, lambda k: DAY + round(
        (k * (1.0 + drift) + phase) * NS
        + 1e9 * (rng.uniform(-scatter, scatter) if bounded else rng.normal(0.0, scatter))
    ))  # fmt: skip
    assert in_step is not None and exchange.watch is not None and not exchange.said_of_stamps
    assert exchange.watch.alarms.keys() == in_step.alarms.keys() != set()
    for now, there in zip(exchange.watch.modes, in_step.modes, strict=True):
        assert now.f_sigma_hz == pytest.approx(there.f_sigma_hz, rel=0.2)


def test_stamps_that_scatter_more_than_can_be_told_apart_are_named(
    model: ReducedModel, record: Record
) -> None:
    rng = np.random.default_rng(3)
    exchange = restamped(started(model), record, lambda k: DAY + k * NS + round(rng.normal(0.0, 0.5 * NS)))
    assert exchange.said_of_stamps.startswith("10 % of the periods and more have no stamp on imu/tip_acc")


def counted(count: PeriodCount, stamps_ns: np.ndarray) -> np.ndarray:
    """Return the periods of stamps [ns]."""
    return np.array([count.count(int(stamp)) for stamp in stamps_ns])


@pytest.mark.parametrize(("phase", "drift"), [(0.0, 20 * PPM), (0.3, 0.0), (0.5, 0.0), (0.8, -20 * PPM)])
def test_no_period_is_left_out_and_none_told_twice_in_five_minutes(phase: float, drift: float) -> None:
    """With 20 ppm the stamps come through half a period, and a fifth of one is scatter."""
    k, rng = np.arange(60_000), np.random.default_rng(1)
    stamps = DAY + ((k * (1.0 + drift) + phase) * NS + rng.uniform(-0.2 * NS, 0.2 * NS, k.size)).astype(int)
    assert (np.diff(counted(PeriodCount(NS), stamps)) == 1).all()


def test_stamps_in_step_are_counted_from_the_zero_of_the_clock() -> None:
    k = np.r_[10:50, 52:90, 500:600, 20:40]  # messages lost, a gap, a clock set back
    count = PeriodCount(NS)
    assert (counted(count, DAY + k * NS) == DAY // NS + k).all()
    assert count.stamp_ns(DAY // NS + 77.5) == DAY + 77 * NS + NS // 2


@pytest.mark.parametrize("rate", [0.95, 1.05])
def test_a_rate_that_is_five_percent_off_is_counted_true_to_the_clock(rate: float) -> None:
    """Else modes would read five percent off."""
    stamps = DAY + (np.arange(4000) / rate * NS).astype(int)
    count = PeriodCount(NS)
    assert np.abs(counted(count, stamps) - stamps / NS).max() <= 1.0
    assert not count.is_thin


@pytest.mark.parametrize("phase", [0.0, 0.4, 0.5, 0.6])
def test_streams_of_other_phases_stay_with_the_same_period_of_their_leader(phase: float) -> None:
    rng, leader = np.random.default_rng(5), PeriodCount(NS)
    led, away = PeriodCount(NS, leader), []
    for k in range(4000):
        leading = leader.count(DAY + round((k + 0.5 + rng.uniform(-0.1, 0.1)) * NS))
        away.append(led.count(DAY + round((k + 0.5 + phase + rng.uniform(-0.1, 0.1)) * NS)) - leading)
    settled = set(away[20:])
    assert len(settled) == 1 and settled <= ({0} if phase < 0.5 else {0, 1})


def test_after_a_step_of_the_clock_streams_agree_again() -> None:
    """A gauge that is told before the encoder of the same instant meets the new time first."""
    leader = PeriodCount(NS)
    led = PeriodCount(NS, leader)
    for start, phase in ((0, 0.5), (9000, 0.1), (3000, 0.7)):
        at = [DAY + round((start + k + phase) * NS) for k in range(100)]
        away = [led.count(stamp) - leader.count(stamp) for stamp in at]
        assert not any(away[2:])
