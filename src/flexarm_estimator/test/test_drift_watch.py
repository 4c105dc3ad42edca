"""The drift watch: slopes against differences, known changes found within sigma, no alarm without a cause."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from planar_strip import DT, SENSORS, Record, StripKinematics, simulate, strip_model

from flexarm_estimator.drift.drift_watch import LONGEST_GAP, SETTLING, DriftWatch
from flexarm_estimator.drift.healthy import HealthyModes
from flexarm_estimator.drift.judgement import Alarms, Healthy, ModeNow
from flexarm_estimator.drift.mode_drift import STIFFNESS_PRIOR, ModeDrift
from flexarm_estimator.drift.proposal import proposal
from flexarm_estimator.drift.score_blocks import ScoreBlocks
from flexarm_estimator.drift.sensitivity import WatchedFilter, watched_filter
from flexarm_estimator.drift.settings import DriftConfig
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.served.reduced_model import ReducedModel

QUIET = EstimatorConfig(frequency_error=0.005, modal_force=0.01)
MODES = (0, 1)


def filter_of(model: ReducedModel) -> WatchedFilter:
    estimator = Estimator(model, StripKinematics(), SENSORS, QUIET, use_compiler=False)
    return watched_filter(estimator.past[0], SENSORS, DT, MODES)


def watch(config: DriftConfig | None = None) -> DriftWatch:
    return DriftWatch(strip_model(), StripKinematics(), SENSORS, (QUIET, config or DriftConfig()), DT)


def feed(watch: DriftWatch, record: Record, first: int = 0) -> DriftWatch:
    for k, samples in enumerate(record.samples):
        watch.step(first + k, {sample.sensor: sample.y for sample in samples}, record.tau[k])
    return watch


def changed(mode: int, damping: bool, h: float) -> ReducedModel:
    """Return the strip with one mode stiffer, or more damped, by the share h."""
    model = strip_model()
    matrix = (model.D if damping else model.K).copy()
    matrix[1 + mode, 1 + mode] *= 1.0 + h
    return replace(model, D=matrix) if damping else replace(model, K=matrix)


@pytest.mark.parametrize("parameter", range(4))
def test_slopes_of_innovations_are_differences_of_filters_of_other_models(parameter: int) -> None:
    """Central difference over a relative change of 1e-3; the third derivative leaves 1e-4."""
    h, mode, damping = 1e-3, parameter % 2, parameter >= 2
    record, plain = simulate(60, np.random.default_rng(0)), filter_of(strip_model())
    filters = [replace(filter_of(changed(mode, damping, step)), K=plain.K) for step in (h, -h)]
    x, s = np.zeros(len(plain.A)), np.zeros(len(plain.A))
    states, m = [x.copy(), x.copy()], len(plain.S)
    for k, samples in enumerate(record.samples):
        y, u = np.concatenate([sample.y for sample in samples]), np.append(record.tau[k], 1.0)
        pushed = plain.slopes[parameter] @ np.append(x, u)
        psi = -(plain.H @ s + pushed[:m])
        s, x = plain.A @ s + pushed[m:] + plain.K @ psi, _next(plain, x, y, u)
        nus = [y - each.H @ state - each.V @ u for each, state in zip(filters, states, strict=True)]
        states = [_next(each, state, y, u) for each, state in zip(filters, states, strict=True)]
        difference = (nus[0] - nus[1]) / (2 * h)
        if k > 5:
            assert psi == pytest.approx(difference, rel=1e-3, abs=1e-4 * abs(psi).max())


def _next(each: WatchedFilter, x: np.ndarray, y: np.ndarray, u: np.ndarray) -> np.ndarray:
    return np.asarray(each.A @ x + each.B @ u + each.K @ (y - each.H @ x - each.V @ u))


@pytest.mark.parametrize("scale", [0.95, 1.0, 1.05])
def test_a_change_of_five_per_cent_is_found_in_every_mode(scale: float) -> None:
    """First order in the change: 5 % come out to half a per cent."""
    record = simulate(1000, np.random.default_rng(1), model=strip_model(frequency_scale=scale), config=QUIET)
    modes = feed(watch(), record).modes
    assert [mode.name for mode in modes] == ["mode_1", "mode_2"]  # the third turns by half a turn in a period
    for mode in modes:
        assert mode.f_hz / mode.described_hz == pytest.approx(scale, abs=0.005 + 4 * mode.change_sigma)
    assert modes[0].change_sigma < 0.005 and modes[0].is_known


@pytest.mark.slow
def test_sigma_is_the_scatter_over_runs() -> None:
    """Twelve runs know a scatter to 20 %; within three of these."""
    found = [
        feed(watch(), simulate(500, np.random.default_rng(seed), config=QUIET)).modes[0] for seed in range(12)
    ]
    scatter = np.std([mode.change for mode in found])
    assert scatter == pytest.approx(found[0].change_sigma, rel=0.6)


def test_more_damping_is_found_and_told() -> None:
    record = simulate(1400, np.random.default_rng(3), model=strip_model(zeta=0.06), config=QUIET)
    seen = feed(watch(DriftConfig(memory=5.0)), record)
    mode = seen.modes[0]
    assert mode.zeta == pytest.approx(0.06, abs=4 * mode.zeta_sigma + 0.005)
    assert "has a damping of" in seen.alarms["mode_1"] and "runs at" not in seen.alarms["mode_1"]
    assert "damping changed" in seen.proposal


def test_a_drift_is_told_with_numbers_and_taken_back_when_it_is_over() -> None:
    softer = simulate(1000, np.random.default_rng(4), model=strip_model(frequency_scale=0.95), config=QUIET)
    seen = feed(watch(), softer)
    assert "mode 1 runs at 4.9" in seen.alarms["mode_1"] and "5.23 Hz (-5" in seen.alarms["mode_1"]
    assert "stiffness were 0." in seen.proposal and "flexarm identify" in seen.proposal
    healthy = simulate(2200, np.random.default_rng(5), config=QUIET)
    feed(seen, healthy, first=1001 + 2 * round(LONGEST_GAP / DT))
    assert not seen.alarms and not seen.proposal


def test_an_arm_that_rests_tells_nothing_and_no_alarm_comes_of_it() -> None:
    record = simulate(900, np.random.default_rng(6), model=strip_model(frequency_scale=0.9), config=QUIET)
    resting = Record(record.t, 0 * record.tau, record.x, [
        [sample._replace(y=0 * sample.y) for sample in samples] for samples in record.samples
    ])  # fmt: skip
    seen = feed(watch(), resting)
    assert not seen.alarms and not seen.modes[0].is_known
    assert seen.modes[0].change_sigma == pytest.approx(STIFFNESS_PRIOR / 2, rel=0.1)


def test_a_missing_sensor_stops_the_learning_and_not_the_watch() -> None:
    record = simulate(900, np.random.default_rng(7), config=QUIET)
    seen = watch()
    for k, samples in enumerate(record.samples):
        heard = {s.sensor: s.y for s in samples if s.sensor != "root_strain" or k % 50 > 5}
        seen.step(k, heard, record.tau[k])
    assert abs(seen.modes[0].change) < 4 * seen.modes[0].change_sigma + 0.005
    assert seen.modes[0].is_known


def test_a_gap_in_time_starts_the_filter_anew_and_old_samples_are_nothing() -> None:
    record = simulate(600, np.random.default_rng(8), config=QUIET)
    seen = feed(watch(), record)
    before = seen.modes
    seen.step(300, {}, np.zeros(1))  # long past
    feed(seen, record, first=600 + 10 * round(LONGEST_GAP / DT))
    assert abs(seen.modes[0].change) < 0.01 and before
    assert round(SETTLING / DT) < 600


def test_a_clock_that_was_set_back_starts_the_filter_anew() -> None:
    softer = simulate(1000, np.random.default_rng(4), model=strip_model(frequency_scale=0.95), config=QUIET)
    seen = feed(watch(), softer, first=100_000)
    assert seen.alarms
    feed(seen, simulate(2200, np.random.default_rng(5), config=QUIET), first=1)
    assert not seen.alarms and abs(seen.modes[0].change) < 0.01


def test_after_long_without_one_sensor_the_filter_starts_anew() -> None:
    """A second in which the torques were lost as well: the axis has gone on, unseen. It read +4.6 %."""
    record = simulate(1200, np.random.default_rng(8), config=QUIET)
    seen = watch()
    for k, samples in enumerate(record.samples):
        is_lost = 700 <= k < 900
        heard = {s.sensor: s.y for s in samples if not is_lost or s.sensor != "root_strain"}
        seen.step(k, heard, 0 * record.tau[k] if is_lost else record.tau[k])
    assert abs(seen.modes[0].change) < 0.005 and seen.modes[0].is_known


def test_a_spike_does_not_move_a_frequency() -> None:
    record = simulate(800, np.random.default_rng(9), config=QUIET)
    plain, hit = watch(), watch()
    for k, samples in enumerate(record.samples):
        heard = {s.sensor: s.y for s in samples}
        plain.step(k, heard, record.tau[k])
        if k == 700:
            heard["tip_accelerometer"] = heard["tip_accelerometer"] + 200.0
        hit.step(k, heard, record.tau[k])
    assert abs(hit.modes[0].change - plain.modes[0].change) < 0.02


def test_another_model_of_the_same_arm_goes_on_with_what_is_known() -> None:
    record = simulate(800, np.random.default_rng(10), model=strip_model(frequency_scale=0.95), config=QUIET)
    seen, other = watch(), feed(watch(), record)
    for k, samples in enumerate(record.samples):
        if k == 400:
            seen.adopt(strip_model())
        seen.step(k, {s.sensor: s.y for s in samples}, record.tau[k])
    assert seen.modes[0].change == pytest.approx(other.modes[0].change, abs=1e-9)


def now(name: str, change: float, sigma: float) -> ModeNow:
    return ModeNow(name, 5.0, 5.0 * (1 + change), 5 * sigma, 0.01, 0.01, 0.001, True, True, change, sigma)


def test_a_healthy_arm_that_is_not_as_described_is_quiet_and_its_change_is_told() -> None:
    """8 % below the description from the start, then 5 % less; the first is learned, the second told."""
    config = DriftConfig(learning=2.0)
    modes = HealthyModes(config)
    assert not modes.judged(modes.compare([now("mode_1", -0.08, 0.002)], 1.0))  # it learns
    (healthy,) = modes.compare([now("mode_1", -0.08, 0.002)], 2.0)
    assert healthy.drift == pytest.approx(0.0) and healthy.drift_sigma == pytest.approx(0.002 * 2**0.5)
    (changed,) = modes.judged(modes.compare([now("mode_1", 0.92 * 0.95 - 1.0, 0.002)], 9.0))
    assert changed.drift == pytest.approx(-0.05)
    alarms = Alarms(config)
    alarms.look([changed], 10.0)
    alarms.look([changed], 11.1)
    assert "at the start it was 4.6 Hz (-5.0 %)" in alarms.told["mode_1"]


def test_a_mode_that_is_not_sure_enough_is_not_judged() -> None:
    modes = HealthyModes(DriftConfig(learning=2.0, sigmas=5.0, frequency_change=0.03))
    assert not modes.judged(modes.compare([now("mode_1", 0.3, 0.01)], 9.0))  # 5 x 1 % are more than 3 %
    assert modes.judged(modes.compare([now("mode_1", 0.3, 0.005)], 9.5))


def test_blocks_of_white_residuals_scatter_as_the_information_says_and_coloured_ones_more() -> None:
    """One parameter, psi = 1: the sum of squared scores is the number of samples, times the colour."""
    rng, count, periods = np.random.default_rng(11), 40_000, 50
    for colour in (0.0, 0.8):
        blocks, nu = ScoreBlocks(1, periods, 1.0 - 1e-6), 0.0
        for e in rng.standard_normal(count):
            nu = colour * nu + e
            blocks.add(np.eye(1), np.array([nu]))
        found = float(blocks.scatter(np.zeros(1))[0, 0]) / count
        # spectrum at zero of an autoregression, 1 / (1 - c)^2; blocks of 50 miss a part of it
        assert found == pytest.approx((1.0 - colour) ** -2, rel=0.25)


def damped(change: float, healthy: Healthy | None = None) -> ModeNow:
    """Return a mode with 2.66 +- 0.3 % of damping where 0.97 % are described."""
    mode = now("mode_5", change, 0.002)
    return replace(mode, described_zeta=0.0097, zeta=0.0266, zeta_sigma=0.003, healthy=healthy)


def alarms_of(mode: ModeNow) -> Alarms:
    """Return what is said after a mode has been so for longer than the patience."""
    alarms = Alarms(DriftConfig())
    alarms.look([mode], 10.0)
    alarms.look([mode], 11.1)
    return alarms


def test_more_damping_alone_is_told_as_damping_and_nothing_else() -> None:
    described, learned = (
        alarms_of(damped(0.0, healthy)) for healthy in (None, Healthy(0.0, 0.0, 0.011, 0.0))
    )
    assert described.told["mode_5"] == "mode 5 has a damping of 2.7 +- 0.3 %, described is 0.97 %"
    assert learned.told["mode_5"] == "mode 5 has a damping of 2.7 +- 0.3 %, at the start it was 1.1 %"
    assert described.is_damping_alone
    said = proposal([damped(0.0)], described.is_damping_alone)
    assert "no frequency did" in said and "flexarm identify" in said and "stiffness" not in said


def test_frequency_and_damping_that_changed_together_are_both_told() -> None:
    alarms = alarms_of(damped(-0.05))
    assert not alarms.is_damping_alone
    told = alarms.told["mode_5"]
    assert "runs at 4.75 Hz" in told and "(-5.0 %) and has a damping of 2.7" in told


def test_modes_that_change_apart_point_to_one_place() -> None:
    together, apart = ([now("mode_1", -0.05, 0.002), now("mode_2", c, 0.002)] for c in (-0.051, 0.0))
    assert "0.902 times" in proposal(together) and "payload or a loose joint" in proposal(apart)


def test_an_alarm_needs_size_certainty_and_time() -> None:
    config = DriftConfig(frequency_change=0.03, sigmas=5.0, patience=1.0)
    for change, sigma, told in ((0.04, 0.002, True), (0.02, 0.001, False), (0.04, 0.02, False)):
        alarms = Alarms(config)
        alarms.look([now("mode_1", change, sigma)], 10.0)
        assert not alarms.told
        alarms.look([now("mode_1", change, sigma)], 11.1)
        assert bool(alarms.told) is told


@pytest.mark.parametrize("change", [0.0, -0.025])
def test_an_alarm_for_damping_ends_when_the_damping_is_back(change: float) -> None:
    """It hung on the frequency: with one that is a little off it stayed, without it had no hysteresis."""
    alarms = alarms_of(damped(change))
    assert alarms.told and alarms.is_damping_alone
    most = DriftConfig().damping_change * 0.0097  # from which it is told
    for part, told in ((0.9, True), (0.5, False)):
        alarms.look([replace(damped(change), zeta=0.0097 + part * most)], 12.0)
        assert bool(alarms.told) is told


def test_an_arm_without_slow_modes_is_refused() -> None:
    with pytest.raises(ValueError, match="nothing to watch"):
        watch(DriftConfig(fastest=0.01))


def test_the_state_of_a_filter_that_starts_is_the_one_given() -> None:
    x = np.arange(len(filter_of(strip_model()).A), dtype=float)
    assert (ModeDrift(filter_of(strip_model()), x, DT, 5.0).x == x).all()


def test_an_alarm_that_stands_while_nothing_is_known_any_more_proposes_without_numbers() -> None:
    """An arm that has stood for a while: "as if all stiffness were nan times"."""
    moved = ModeNow("mode_1", 10.0, 9.0, 0.01, 0.01, 0.01, 0.001, True, True, -0.1, 0.001)
    parked = replace(moved, f_hz=10.0, is_known=False, is_damping_known=False, change=0.0, change_sigma=0.15)
    alarms = Alarms(DriftConfig())
    for t in range(400):
        alarms.look([moved if t < 100 else parked], float(t))
    assert list(alarms.told) == ["mode_1"]
    assert "0.81" in proposal([moved], alarms.is_damping_alone)
    assert proposal([parked], alarms.is_damping_alone).startswith("refresh the description by a modal test")
