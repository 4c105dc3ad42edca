"""Changes of many bandwidths: read right, or not called known; never told apart when all changed alike."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planar_strip import DT, SENSORS, StripKinematics, simulate, strip_model
from test_drift_watch import QUIET, feed, filter_of, now, watch

from flexarm_estimator.drift.judgement import Alarms
from flexarm_estimator.drift.mode_drift import STIFFNESS_PRIOR, ModeDrift
from flexarm_estimator.drift.proposal import ALL_ALIKE, proposal
from flexarm_estimator.drift.running_point import (
    LASTING,
    LONGEST,
    RANGE,
    SETTLED,
    RunningPoint,
    running_model,
)
from flexarm_estimator.drift.sensitivity import watched_filter
from flexarm_estimator.drift.settings import DriftConfig
from flexarm_estimator.estimator import Estimator

LATER = LASTING + 0.01  # s


@pytest.mark.parametrize("scale", [0.7, 0.8, 1.2, 1.4])
def test_a_change_of_many_bandwidths_is_read_right_in_every_mode(scale: float) -> None:
    """Linear about the description alone, mode 2 stayed near it and was called known."""
    record = simulate(3000, np.random.default_rng(1), model=strip_model(frequency_scale=scale), config=QUIET)
    seen = feed(watch(), record)
    for mode in seen.modes:
        assert mode.is_certain
        assert mode.f_hz / mode.described_hz == pytest.approx(scale, abs=0.005 + 4 * mode.change_sigma)
    assert seen.proposal.startswith(ALL_ALIKE)


def test_a_mode_that_cannot_be_found_is_not_known_nor_told_the_wrong_way() -> None:
    """Under these torques mode 2 at -40 % reads as one near the description that is damped much more."""
    softer = simulate(2000, np.random.default_rng(1), model=strip_model(frequency_scale=0.6), config=QUIET)
    seen, after = watch(), []
    for k, samples in enumerate(softer.samples):
        seen.step(k, {sample.sensor: sample.y for sample in samples}, softer.tau[k])
        after += [seen.modes] if k > 1000 else []
    assert set(seen.alarms) == {"mode_1"} and "apart" not in seen.proposal
    assert after[-1][0].is_certain and after[-1][0].change == pytest.approx(-0.4, abs=0.005)
    assert not any(modes[1].is_certain for modes in after)


def test_what_a_knock_left_is_taken_back_when_the_mode_has_been_read_anew() -> None:
    """Mode 2 was told at -4 % for as long as the knock was remembered."""
    record, seen = simulate(1700, np.random.default_rng(9), config=QUIET), watch()
    for k, samples in enumerate(record.samples):
        heard = {s.sensor: s.y for s in samples}
        if k == 700:
            heard["tip_accelerometer"] = heard["tip_accelerometer"] + 200.0
        seen.step(k, heard, record.tau[k])
    assert not seen.alarms and abs(seen.modes[1].change) < 0.02


def test_the_point_follows_what_lasts_and_in_steps_that_slopes_see() -> None:
    point, far = RunningPoint(["mode_1", "mode_2"]), [now("mode_1", -0.4, 0.01), now("mode_2", 0.01, 0.001)]
    assert point.step(far, 10.0) is None and point.step([now("mode_1", 0.0, 0.01)], 10.5) is None
    assert point.step(far, 11.0) is None
    shift = point.step(far, 11.0 + LATER)
    assert shift == pytest.approx([(1.0 - LONGEST) ** 2 - 1.0, 0.0])
    assert point.ratio == pytest.approx([1.0 - LONGEST, 1.0])


def test_a_reading_is_settled_near_the_point_some_time_after_the_last_step() -> None:
    point, mode = RunningPoint(["mode_1"]), now("mode_1", 0.1, 0.001)
    assert not point.settled([mode], 5.0)[0].is_settled  # outside
    point.step([mode], 5.0)
    point.step([mode], 5.0 + LATER)
    assert not point.settled([mode], 6.2)[0].is_settled
    assert point.settled([mode], 5.1 + LATER + SETTLED)[0].is_settled


def test_a_mode_at_the_end_of_the_range_is_not_known() -> None:
    point, gone = RunningPoint(["mode_1"]), now("mode_1", 1.0, 0.001)
    for t in np.arange(0.0, 20.0, 0.1):
        point.step([gone], float(t))
    assert point.ratio == pytest.approx([RANGE[1]])
    assert not point.settled([gone], 100.0)[0].is_certain


def test_a_mode_that_reads_many_times_as_damped_is_not_known_and_its_damping_still_told() -> None:
    mode = replace(now("mode_1", 0.01, 0.002), zeta=0.035)
    assert mode.is_known and mode.is_damped and not mode.is_certain
    alarms, moving = Alarms(DriftConfig()), Alarms(DriftConfig())
    for t in (10.0, 11.1):
        alarms.look([mode], t)
        moving.look([replace(mode, is_settled=False)], t)
    assert "has a damping of" in alarms.told["mode_1"] and not moving.told


def test_modes_are_not_told_apart_while_one_is_out_of_reach_or_the_alarm_is_new() -> None:
    found, lost = now("mode_1", 0.4, 0.003), now("mode_2", 0.05, 0.02)
    assert "apart" in proposal([found, lost])
    assert proposal([found, replace(lost, is_settled=False)]).startswith("too early to tell")
    assert proposal([found, replace(lost, zeta=0.1)], is_early=True).startswith("too early to tell")
    never = proposal([found, replace(lost, zeta=0.1)])  # an hour later it was still too early
    assert never.startswith("whether all changed alike cannot be told, for mode 2 reads many times as damped")
    assert proposal([found, lost], is_early=True).startswith("too early to tell")
    assert "stiffness were 1.95" in proposal([found, now("mode_2", 0.39, 0.02)], is_early=True)


def test_an_alarm_is_not_taken_back_by_a_reading_out_of_reach() -> None:
    alarms, drifted = Alarms(DriftConfig()), now("mode_1", 0.05, 0.002)
    for t in (10.0, 11.1):
        alarms.look([drifted], t)
    back = now("mode_1", 0.0, 0.002)
    alarms.look([replace(back, is_settled=False)], 12.0)
    assert alarms.told and alarms.newest == 11.1
    alarms.look([back], 13.0)
    assert not alarms.told


def test_a_mode_that_moves_is_learned_anew_and_a_small_step_leaves_the_others() -> None:
    """The filter of the moved point is that of the model there, and the other mode reads on."""
    record, near = simulate(800, np.random.default_rng(2), config=QUIET), np.array([1.0, 0.97])
    for ratio, stays in ((near, True), (np.array([1.0, 0.8]), False)):
        drift = ModeDrift(filter_of(strip_model()), np.zeros(9), DT, 5.0)
        for k, samples in enumerate(record.samples):
            drift.step(np.concatenate([s.y for s in samples]), np.append(record.tau[k], 1.0))
        before = drift.deltas()
        drift.move(filter_of(running_model(strip_model(), (0, 1), ratio)), np.eye(9), ratio**2 - 1.0)
        after = drift.deltas()
        assert after.stiffness[1] == 0.0 and after.stiffness_sigma[1] == pytest.approx(STIFFNESS_PRIOR)
        if stays:
            assert after.stiffness[0] == pytest.approx(before.stiffness[0], abs=1e-9)
        assert bool(after.stiffness_sigma[0] < 0.01) is stays


def test_the_model_at_the_point_is_the_one_whose_modes_run_there() -> None:
    moved, softer = running_model(strip_model(), (0, 1, 2), np.full(3, 0.8)), strip_model(frequency_scale=0.8)
    for found, wanted in ((moved.K, softer.K), (moved.D, softer.D)):
        assert found == pytest.approx(wanted)
    assert moved.omega == pytest.approx(softer.omega) and running_model(softer, (0,), np.ones(1)) is softer


def test_readings_do_not_depend_on_the_point() -> None:
    """The same record read about the description and about a point 1 % away."""
    record = simulate(1000, np.random.default_rng(3), config=QUIET)
    found = []
    for at in (1.0, 0.99):
        model = running_model(strip_model(), (0, 1), np.full(2, at))
        parts = Estimator(model, StripKinematics(), SENSORS, QUIET, use_compiler=False).past[0]
        drift = ModeDrift(watched_filter(parts, SENSORS, DT, (0, 1)), np.zeros(9), DT, 5.0)
        for k, samples in enumerate(record.samples):
            drift.step(np.concatenate([s.y for s in samples]), np.append(record.tau[k], 1.0), counts=k > 200)
        found.append(at * np.sqrt(1.0 + drift.deltas().stiffness))
    assert found[0] == pytest.approx(found[1], abs=1e-3)  # second order in 1 %, times some ten
