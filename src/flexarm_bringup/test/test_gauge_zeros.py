"""Gauges whose bridge is not zeroed: the shipped descriptions learn it, and the tip stays where it is known.

The whole tour is done with every gauge off, in turn up and down. e0 is the tip's RMS error without that, from
one second on. A bridge that was out of its plug comes back with another zero.
"""

from __future__ import annotations

from dataclasses import replace

import pytest

from flexarm_bringup.fault_drill.stand import Stand, Trace
from flexarm_bringup.sim.sensor_faults import SensorFault
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.interventions.toggle_sensor import ToggleSensor
from flexarm_estimator.measurement import Measurement

SETTLED = 1.0  # s
GAUGE = "strain_gauge"


STRIP = "root_strain"
OUT, IN = 2.5, 4.5  # s; while the plug is out


def rms(trace: Trace, since: float = SETTLED) -> float:
    """Return the RMS tip error once the zeros are learned [m]."""
    return trace.rms(since, float(trace.t[-1]))


def accused(trace: Trace) -> set[tuple[str, str]]:
    """Return who was put out of use, and why."""
    reports = [report for estimate in trace.estimates for report in estimate.sensors]
    return {(report.name, report.reason) for report in reports if report.status == "faulty"}


@pytest.mark.parametrize(
    ("name", "zero", "worth"),
    [
        ("single_link", 2e-6, 3.0),
        pytest.param("spatial_3tpt", 20e-6, 2.0, marks=pytest.mark.slow),
        pytest.param("serial_6r", 20e-6, 10.0, marks=pytest.mark.slow),
    ],
)
def test_bridges_that_are_not_zeroed_do_not_move_the_tip(name: str, zero: float, worth: float) -> None:
    """Without biases nobody is accused of it either, or somebody else."""
    stand = Stand(name)
    gauges = [spec.name for spec in stand.of_kind(GAUGE)]
    off = {gauge: SensorFault("bias", 0.0, bias=zero * (-1) ** i) for i, gauge in enumerate(gauges)}
    trace, e0 = stand.play(off), rms(stand.nominal)
    known = Estimator(
        stand.record.model,
        stand.arm.tree,
        tuple(replace(spec, bias=None) if spec.kind == GAUGE else spec for spec in stand.sensors),
        stand.settings,
    )
    without = rms(stand.play(off, estimator=known))
    print(f"\n{name}: {1e6 * e0:.1f} um; zeros off {rms(trace) / e0:.2f} e0, no biases {without / e0:.1f} e0")
    assert accused(trace) == set()
    assert rms(trace) <= 1.1 * e0
    assert without > worth * e0


@pytest.mark.parametrize(
    ("zero", "seed"),
    [
        (-150e-6, 1),
        *(pytest.param(z, s, marks=pytest.mark.slow) for z in (40e-6, 105e-6, 150e-6) for s in (1, 2, 3)),
    ],
)
def test_a_zero_within_what_the_strip_is_described_with_is_learned_and_nobody_accused(
    zero: float, seed: int
) -> None:
    """With a third of the sigma 40 ustrain accused the accelerometer, and 150 took the encoder with it."""
    stand = Stand("single_link", seed)
    trace = stand.play({STRIP: SensorFault("bias", 0.0, bias=zero)})
    assert accused(trace) == set()
    assert rms(trace) <= 1.1 * rms(stand.nominal)


@pytest.mark.parametrize("zero", [3e-6, pytest.param(20e-6, marks=pytest.mark.slow)])
@pytest.mark.parametrize("by_hand", [False, True])
def test_a_bridge_that_was_unplugged_comes_back_with_another_zero(zero: float, by_hand: bool) -> None:
    """Its bias was known to 0.1 ustrain: 3 more moved the tip by 5.7 told sigmas, with 20 it stayed out."""
    stand = Stand("single_link")
    estimator = stand.estimator()

    def change(tick: int, samples: list[Measurement]) -> list[Measurement]:
        """Pull the plug, or switch the sensor off."""
        t = float(stand.record.t[tick])
        if by_hand and min(abs(t - OUT), abs(t - IN)) < stand.dt / 2:
            ToggleSensor(STRIP, is_on=t > OUT + stand.dt).apply(estimator)
        kept = [s for s in samples if s.sensor != STRIP or by_hand or not OUT <= s.t < IN]
        return [s._replace(y=s.y + zero) if s.sensor == STRIP and s.t >= IN else s for s in kept]

    trace = stand.play(estimator=estimator, change=change)
    assert accused(trace) == set()
    assert rms(trace, IN) <= 1.2 * rms(stand.nominal, IN)
