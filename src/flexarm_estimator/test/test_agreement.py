"""Samples that are not fused are held against the state at their own stamp, late and between ticks."""

from __future__ import annotations

import numpy as np
import pytest
from planar_strip import DT, SENSORS, StripKinematics, arriving, simulate, strip_model

from flexarm_estimator.estimate import Estimate
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.exclusion.agreement import compare_at_stamp
from flexarm_estimator.isolation.isolation_watch import IsolationWatch
from flexarm_estimator.judging.short_term import SHIFT, _agree
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig

RECORD = simulate(1200, np.random.default_rng(5), camera_every=7)
LATE = 12  # ticks from exposure to arrival
SHIFT_FROM, MILLIMETRES_18 = 3.0, 0.018


@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.9, 1.0])
@pytest.mark.parametrize("back", [1, 7])
def test_the_state_is_that_of_the_stamp_and_not_of_the_tick_before(share: float, back: int) -> None:
    estimator = Estimator(strip_model(), StripKinematics(), SENSORS, EstimatorConfig())
    for k in range(400):
        estimator.step(arriving(RECORD, k, LATE), RECORD.tau[k], float(RECORD.t[k]))
    _, instants = estimator.past
    before, after = instants[-1 - back], instants[-back]
    t = before.t + share * (after.t - before.t)
    theta, rate = (1 - share) * before.belief.x[0] + share * after.belief.x[0], before.belief.x[4]
    nu = compare_at_stamp(Measurement("encoder", t, np.array([theta])), instants).nu[0]
    bound = 1e-3 * abs(rate) * DT + 2e-5  # rad, of a whole period's way and of what the samples of it said
    assert abs(nu) < bound < 0.1 * abs(rate) * DT


def shifted_camera(until: float) -> list[Estimate]:
    """Return what is told of a camera that is 18 mm off from ``SHIFT_FROM`` until then [s]."""
    estimator = Estimator(strip_model(), StripKinematics(), SENSORS, EstimatorConfig())
    told = []
    for k in range(len(RECORD.t)):
        samples = [
            s._replace(y=s.y + MILLIMETRES_18 * (np.arange(6) == 1))
            if s.sensor == "camera" and SHIFT_FROM <= s.t < until
            else s
            for s in arriving(RECORD, k, LATE)
        ]
        told.append(estimator.step(samples, RECORD.tau[k], float(RECORD.t[k])))
    return told


def camera(estimate: Estimate) -> str:
    return next(report.status for report in estimate.sensors if report.name == "camera")


def test_a_late_camera_that_is_off_stays_out_while_the_arm_moves() -> None:
    told = shifted_camera(np.inf)
    out = [k for k, estimate in enumerate(told) if camera(estimate) == "faulty"]
    assert SHIFT in " ".join(report.reason for report in told[out[0]].sensors)
    assert out == list(range(out[0], len(told)))
    assert all(estimate.status != "lost" for estimate in told[100:])


def test_a_late_camera_that_is_sound_again_comes_back_while_the_arm_moves() -> None:
    told = shifted_camera(4.0)
    back = [estimate.t for estimate in told if estimate.t > 4.0 and camera(estimate) == "ok"]
    assert back and back[0] < 4.6
    assert camera(told[-1]) == "ok"


def test_a_flipped_gauge_does_not_come_back_when_its_strain_goes_through_zero() -> None:
    """Half the shift was as much as the mean over 0.2 s had to be below: so it is while an arm swings."""
    start = np.zeros(9)
    start[1], start[4] = 4e-3, 0.3
    record = simulate(800, np.random.default_rng(6), x0=start, camera_every=7)
    estimator, told = Estimator(strip_model(), StripKinematics(), SENSORS, EstimatorConfig()), []
    watches = estimator._watches
    watches.all = tuple(watch for watch in watches.all if not isinstance(watch, IsolationWatch))
    for k in range(len(record.t)):
        samples = arriving(record, k, LATE)
        if k >= 300:
            samples = [s._replace(y=-s.y) if s.sensor == "root_strain" else s for s in samples]
        told.append(estimator.step(samples, record.tau[k], float(record.t[k])))
    statuses = [next(r.status for r in e.sensors if r.name == "root_strain") for e in told]
    out = statuses.index("faulty", 300)
    assert out < 320
    assert set(statuses[out:]) == {"faulty"}


@pytest.mark.parametrize("shift", [8.0, 20.0, 60.0])
def test_a_shift_is_seen_whatever_the_units_of_the_other_channels(shift: float) -> None:
    """In metres and radians the noise of the rotations hid it up to 60 sigmas."""
    rng = np.random.default_rng(1)
    for _ in range(100):
        assert _agree(shift * (np.arange(6) == 1) + rng.standard_normal((3, 6)))
        assert not _agree(rng.standard_normal((3, 6)) * shift)
