"""Channels at fault are named by how well the past is explained; on the strip in closed form."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from planar_strip import DT, ENCODER, SENSORS, StripKinematics, arriving, simulate, strip_model

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.filter import Belief, GuardedFilter, innovation_covariance
from flexarm_estimator.filters.served import ServedSteps
from flexarm_estimator.isolation import inquiry
from flexarm_estimator.isolation.case import SHARES, Case, excess_of, fit_noise
from flexarm_estimator.isolation.channels import Channels
from flexarm_estimator.isolation.consistency_run import NO_OFFSETS, ConsistencyRun
from flexarm_estimator.isolation.hypotheses import Hypotheses, Rearrangement, rearrangements
from flexarm_estimator.isolation.investigation import investigate
from flexarm_estimator.isolation.isolation import (
    Explanation,
    decide,
    explain_by_saturation,
    is_silent,
    samples_at_limit,
    share_said,
)
from flexarm_estimator.isolation.isolation_watch import IsolationWatch
from flexarm_estimator.isolation.leaving_out import _own_story, are_loud, in_another_way
from flexarm_estimator.isolation.suspicion import Suspicion
from flexarm_estimator.isolation.window import StepMaker, Window
from flexarm_estimator.judging.gate import Gate
from flexarm_estimator.judging.sample_judge import Verdict
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.parts import PartsMaker
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.steps.stack import stack_rows
from flexarm_estimator.watches.watch import View
from flexarm_model.manipulator.sensor_spec import SensorSpec

CONFIG = EstimatorConfig()
QUIET = EstimatorConfig(
    motion_acceleration=0.05, modal_force=0.01, acceleration_noise=0.01, disturbance_drift=0.1
)
RECORD = simulate(500, np.random.default_rng(21), config=QUIET, camera_every=7)  # torque shakes the strip


def make_parts(config, model):
    gate = Gate({spec.name: spec.sigma.tolist() for spec in SENSORS}, config)
    return PartsMaker(StripKinematics(), SENSORS, config, gate).make(model)


PARTS = make_parts(CONFIG, strip_model())
CHANNELS = Channels(SENSORS, PARTS.sensors.rows)
STRAIN = 1
NOBODY = frozenset()


def window(first=100, count=40, change=lambda y: y):
    y = np.array([np.concatenate([s.y for s in RECORD.samples[k][:3]]) for k in range(first, first + count)])
    u = np.column_stack([RECORD.tau[first : first + count], np.ones(count)])
    return Window(RECORD.t[first : first + count], u, change(y), [PARTS] * count, np.zeros(1))


def run(w, hypotheses, ignored=None, offsets=NO_OFFSETS):
    ignored = np.zeros(w.y.shape, dtype=bool) if ignored is None else ignored
    result = ConsistencyRun(w, hypotheses, StepMaker(1e-5), ignored, offsets)
    result.advance(len(w.t))
    return result


def test_misfit_and_determinant_are_those_of_filterpy():
    """Oracle: the ordinary filter, one step after the other, whose gains come from another formula."""
    w = window(count=30)
    got = run(w, rearrangements(CHANNELS, NOBODY))
    step = PARTS.process.step(DT)
    stack = stack_rows(list(PARTS.sensors.rows.values()), PARTS.process.force_cov)
    kalman, belief = GuardedFilter(9, 2), Belief(np.zeros(9), PARTS.process.P0)
    misfit = log_det = 0.0
    for k in range(1, 30):
        prior, M = kalman.predict(belief, step, w.u[k]), stack.cross(step)
        S = innovation_covariance(prior.P, stack.C, stack.R_total, M)
        nu = w.y[k] - stack.C @ prior.x - stack.D @ w.u[k]
        misfit, log_det = misfit + nu @ np.linalg.solve(S, nu), log_det + np.linalg.slogdet(S)[1]
        belief = kalman.update(prior, nu, stack.C, stack.R_total, M)
    np.testing.assert_allclose(got.misfit[:, 0].sum(), misfit, rtol=1e-6)  # the start is ill-conditioned
    np.testing.assert_allclose(got.log_det.sum(), log_det, rtol=1e-6)


def test_a_channel_left_out_is_as_if_it_did_not_exist():
    rows = [model for name, model in PARTS.sensors.rows.items() if name != "root_strain"]
    sensors = SimpleNamespace(rows=dict(enumerate(rows)))
    steps = ServedSteps(PARTS.process, sensors)
    fewer = SimpleNamespace(process=PARTS.process, layout=PARTS.layout, sensors=sensors, steps=steps)
    w = window(count=30)
    ignored = np.zeros(w.y.shape, dtype=bool)
    ignored[:, STRAIN] = True
    without = Window(w.t, w.u, w.y[:, [0, 2]], [fewer] * 30, w.theta)
    well = Hypotheses.of([Rearrangement((), "", np.arange(2), np.ones(2))])
    other = ConsistencyRun(without, well, StepMaker(1e-5), ignored[:, [0, 2]])
    other.advance(30)
    got = run(w, rearrangements(CHANNELS, NOBODY), ignored)
    np.testing.assert_allclose(got.misfit, other.misfit, rtol=1e-4)  # its noise is 1e8 times as large
    np.testing.assert_allclose(got.log_det, other.log_det, atol=1e-3)


def test_a_stiffness_that_is_not_as_described_is_learned_within_the_window():
    """Of a model 4 % too high in frequency, whatever is said of it before; against the run that knows it."""

    def misfit(scale, learned=(), **settings):
        config = EstimatorConfig(**{**vars(QUIET), **settings})
        parts, w = make_parts(config, strip_model(frequency_scale=scale)), window(count=60)
        w = Window(w.t, w.u, w.y, [parts] * 60, w.theta, learned)
        return run(w, rearrangements(CHANNELS, NOBODY)).misfit.sum()

    told, wrong = misfit(1.0), misfit(1.04, frequency_error=0.0)
    for learned in (0.0, -0.1):
        found = misfit(1.04, (learned,), stiffness_modes=3, stiffness_error=0.3, stiffness_rest=1.0)
        assert found < told + 0.2 * (wrong - told)  # its tangents cost something


def test_a_state_that_is_given_up_takes_nothing_from_what_is_investigated():
    def named_at(give_up_at=None):
        watch = IsolationWatch(SENSORS)
        watch.use(PARTS)
        for k, t in enumerate(RECORD.t[100:400].tolist()):
            said = [Measurement("root_strain", s.t, -s.y) if s.sensor == "root_strain" else s
                    for s in RECORD.samples[100 + k][:3]]  # fmt: skip
            u, far = np.append(RECORD.tau[100 + k], 1.0), Verdict("root_strain", t, True, np.zeros(1), 3.0)
            if k == give_up_at:
                watch.restart(t)
            if watch.look(View(t, u, Belief(np.zeros(9), PARTS.process.P0), said, [far], u)):
                return k
        return None

    assert named_at(30) == named_at() < 100


def at_rest(k):
    """Return the noise of all rows at a tick."""
    rng = np.random.default_rng(k)
    return [
        Measurement(spec.name, DT * k, spec.sigma * rng.normal(size=spec.sigma.size))
        for spec in SENSORS
        if spec.name in PARTS.sensors.rows
    ]


def pieces_by_tick(monkeypatch, normalised, ticks=400, is_moving=True):
    """Return in which ticks there was a frame, and how many pieces of both inquiries were done in each.

    Those of the usual one, then those of the close one, (2, ticks).
    """
    done = []

    def counted(case, entries):
        pieces = investigate(case, entries)
        while True:
            try:
                next(pieces)
            except StopIteration as end:
                return end.value
            done[-1][int(case.is_close)] += 1
            yield

    monkeypatch.setattr(inquiry, "investigate", counted)
    watch, frames = IsolationWatch(SENSORS), []
    watch.use(PARTS)
    for k, t in enumerate(RECORD.t[:ticks].tolist()):
        u = np.append(RECORD.tau[k] * is_moving, 1.0)
        said = arriving(RECORD, k, 12) if is_moving else at_rest(k)
        verdicts = [Verdict(sample.sensor, t, True, np.zeros(1), normalised) for sample in said]
        done.append([0, 0])
        frames.append(any(sample.sensor == "camera" for sample in said))
        watch.look(View(t, u, Belief(np.zeros(9), PARTS.process.P0), said, verdicts, u))
    return np.array(frames), np.array(done).T


def test_without_suspicion_there_is_little_to_do_in_a_tick_and_hardly_ever_beside_a_late_frame(
    monkeypatch,
):
    frames, (usual, close) = pieces_by_tick(monkeypatch, normalised=1.0)
    assert close.sum() > 20
    assert usual.sum() == 0  # a close look is a self-check, too
    assert close.max() in (4, 6)  # six in a look in which something seems to be remarkable
    assert (close > 0).mean() < 1 / 4
    assert (close > 4).mean() < 0.05
    assert frames.sum() > 50
    assert ((usual + close)[frames] > 0).mean() < 0.05  # where it is urgent, or has been put off for long


def test_where_the_arm_rests_there_is_nothing_to_look_closely_at_and_a_self_check_now_and_then(monkeypatch):
    _, (usual, close) = pieces_by_tick(monkeypatch, normalised=1.0, is_moving=False)
    assert close.sum() == 0
    assert usual.sum() > 20
    assert usual.max() == 4
    assert (usual > 0).mean() < 1 / 4


def test_a_suspicion_is_followed_up_several_pieces_a_tick_also_beside_a_late_frame(monkeypatch):
    frames, (usual, _) = pieces_by_tick(monkeypatch, normalised=3.0)
    assert usual.max() > 1
    assert usual[frames].any()


def drained(pieces):
    """Do all pieces and return what they return."""
    while True:
        try:
            next(pieces)
        except StopIteration as end:
            return end.value


@pytest.mark.parametrize(("times", "share"), [(0.1, 1.0), (2.5, 0.1), (10.0, 0.01)])
@pytest.mark.parametrize("first", [60, 200, 300])
def test_as_much_process_noise_is_counted_on_as_there_is(first, times, share):
    """Of that with which the record was made: intensities are squares."""
    names = ("motion_acceleration", "modal_force", "acceleration_noise")
    told = {name: times * getattr(QUIET, name) for name in names}
    parts = make_parts(replace(QUIET, **told), strip_model())
    w = replace(window(first, 60), parts=[parts] * 60)
    case = Case(CHANNELS, NOBODY, StepMaker(1e-5), is_urgent=False, is_close=True)
    ignored = np.zeros(w.y.shape, dtype=bool)
    for _ in SHARES:  # window after window
        found = drained(fit_noise(case, w, ignored, case.all_well))
        case.share, used = case.next_share, case.share
    assert used == case.next_share == share
    assert (excess_of(found, w, ignored) <= 1.0) == (times > 0.1)


def test_a_channel_is_detached_only_where_the_others_know_that_it_should_say_more():
    rng = np.random.default_rng(7)
    noise, motion = rng.normal(size=60), 10.0 * np.sin(0.3 * np.arange(60))

    def is_missed(z, S):
        return _own_story(noise, z, np.full(60, S), 1.0).is_missed

    assert is_missed(motion, 1.0)
    assert not is_missed(0.1 * motion, 1.0)  # it could not say that over its noise
    assert not is_missed(motion, 1e6)  # an axis whose place nobody else tells


def test_an_offset_that_is_looked_for_is_excused():
    shift = 40e-6
    offsets = np.outer(CHANNELS.sigma, (40.0, 1.0))  # forty sigmas of the gauge are nothing unusual
    all_well = rearrangements(CHANNELS, NOBODY)
    shifted = run(window(change=lambda y: y + [0, shift, 0]), all_well, offsets=offsets)
    sound = run(window(), all_well, offsets=offsets)
    assert shifted.misfit[:, 0].sum() > 2.0 * sound.misfit[:, 0].sum()
    assert shifted.excused(STRAIN).sum() <= sound.misfit[:, 0].sum() + 2.0  # it costs one squared sigma


def test_rearranging_undoes_every_fault_that_it_stands_for():
    channels = Channels(SENSORS + tuple(SENSORS[1:2]), ["encoder", "root_strain", "tip_accelerometer"])
    Y = np.arange(12.0).reshape(4, 3)
    hypotheses = rearrangements(channels, frozenset(range(3)))
    for i, hypothesis in enumerate(hypotheses.all):
        wrong = (Y * hypothesis.sign)[:, hypothesis.source]
        np.testing.assert_array_equal(hypotheses.undo(wrong)[:, :, i], Y)


def explanation(channels, gain, words="", **more):
    return Explanation(channels, words, np.asarray(gain, dtype=float), 1.0, **more)


def test_the_clear_winner_is_told_and_nothing_else():
    flipped = explanation((1,), (200, 300), "sign is flipped")
    assert decide([flipped, explanation((2,), (100, 100), "sign is flipped")]) is flipped
    assert decide([flipped, explanation((2,), (200, 295))]) is None  # something else may be wrong
    assert decide([flipped, explanation((2,), (200, 299), is_excuse=True)]) is None
    assert decide([flipped, explanation((1,), (300, 300))]) is flipped  # the same channel
    assert decide([explanation((1,), (0, 500), "sign is flipped")]) is None  # an impact, or the beginning
    assert decide([Explanation((1,), "sign is flipped", np.full(2, 500.0), 9.0)]) is None  # nothing fits


def test_what_cannot_be_detached_is_not_told_but_stands_against_others():
    """Encoders of axes at rest were called detached, on an arm 50 % heavier than its model."""
    assert [channel.can_float for channel in CHANNELS.all] == [
        False,
        True,
        True,
    ]  # encoder, gauge, accelerometer
    detached = explanation(
        (0,), (300, 400), "is detached (says 1 +- 0 whatever the arm does)", needs_both=False
    )
    unnamed = in_another_way(detached)
    assert decide([detached]) is detached
    assert decide([unnamed]) is None
    flipped = explanation((1,), (200, 300), "sign is flipped")
    assert decide([flipped, unnamed]) is None and decide([flipped]) is flipped


def test_noise_is_silence_and_vibration_is_not():
    rng = np.random.default_rng(3)
    assert is_silent(rng.normal(size=60), 1.0)
    assert is_silent(100.0 * rng.normal(size=60), 1.0)  # white, if loud
    assert not is_silent(10.0 * np.sin(0.3 * np.arange(60.0)), 1.0)


def test_values_at_a_limit_are_those_that_repeat_the_largest_exactly():
    y = np.clip(np.sin(0.2 * np.arange(60.0)), -2.0, 0.5)
    np.testing.assert_array_equal(samples_at_limit(y), y == 0.5)
    assert not samples_at_limit(np.random.default_rng(4).normal(size=60)).any()


FAULTS = {
    "sign is flipped": lambda y, rng: -y,
    "is detached": lambda y, rng: rng.normal(size=1) * 1e-7,
    "is saturated": lambda y, rng: np.clip(y, -3e-5, 3e-5),
}


def find(words, sensor, start, end=np.inf, model=None):
    """Return when a sensor was named for the first time, when cleared [s], and who else was named."""
    estimator = Estimator(strip_model() if model is None else model, StripKinematics(), SENSORS, CONFIG)
    rng = np.random.default_rng(5)
    named, cleared, others = np.inf, np.inf, set()
    for k, t in enumerate(RECORD.t):
        samples = [
            Measurement(s.sensor, s.t, FAULTS[words](s.y, rng))
            if s.sensor == sensor and start <= s.t < end
            else s
            for s in arriving(RECORD, k, 12)
        ]
        estimate = estimator.step(samples, RECORD.tau[k], float(t))
        for report in estimate.sensors:
            is_named = report.status == "faulty" and "squared sigmas" in report.reason
            if is_named and report.name != sensor:
                others.add((report.name, report.reason))
            elif is_named and words in report.reason:
                named = min(named, float(t))
            elif report.name == sensor and named < t and not is_named:
                cleared = min(cleared, float(t))
    return named, cleared, others


@pytest.mark.parametrize("words", FAULTS)
def test_a_gauge_at_fault_is_named_within_a_second(words):
    named, _, others = find(words, "root_strain", 0.5)
    assert named <= 1.5
    assert not others


@pytest.mark.slow
@pytest.mark.parametrize("scale", [0.9, 1.1])
@pytest.mark.parametrize("start", [0.0, 0.5])
@pytest.mark.parametrize("words", FAULTS)
def test_a_gauge_at_fault_is_named_within_a_second_with_frequencies_ten_percent_off(words, start, scale):
    named, _, others = find(words, "root_strain", start, model=strip_model(frequency_scale=scale))
    assert named <= start + 1.0
    assert not others


def test_a_channel_that_is_well_again_is_cleared():
    named, cleared, others = find("sign is flipped", "root_strain", 0.5, end=1.2)
    assert named <= 1.2 < cleared <= 2.4
    assert not others


def test_a_detached_channel_that_speaks_again_is_cleared_on_an_arm_that_is_not_its_model():
    """It waited for all to be well, on a stiff model a second; an encoder of a soft arm waited for ever."""
    named, cleared, others = find("is detached", "root_strain", 0.5, 1.1, strip_model(frequency_scale=1.19))
    assert named <= 1.1 < cleared <= 1.5
    assert not others


@pytest.mark.parametrize(
    ("share", "is_loud"), [(1.0, True), (0.6, True), (0.4, False), (1.0 / 9.80665, False)]
)
def test_a_channel_is_loud_from_half_of_what_the_others_predict_on_and_all_of_a_sensor_must_be(
    share, is_loud
):
    """An accelerometer in g was called detached and heard again, in turns (row 17 of the fault matrix)."""
    z = np.sin(20.0 * np.linspace(0.0, 1.0, 50))
    run = SimpleNamespace(predicted=np.column_stack([z, z, z]))
    window = SimpleNamespace(y=np.column_stack([0.0 * z, z, share * z]))
    assert are_loud((1,), window, run)
    assert are_loud((2,), window, run) == are_loud((1, 2), window, run) == is_loud
    assert not are_loud((0, 1), window, run)


def test_a_channel_that_says_nothing_says_the_least_share_of_what_is_predicted_for_it():
    t = np.linspace(0.0, 1.0, 50)
    z = np.sin(20.0 * t)
    assert share_said(0.5 * z, z) == pytest.approx(0.25)
    assert share_said(np.where(t < 0.1, 9.0, 1e-3 * z), z) == pytest.approx(1e-6)  # before it has settled
    assert share_said(np.full(50, np.nan), z) == np.inf  # never the least


def test_sensors_of_several_channels_are_swapped_as_a_whole_where_all_of_both_may_be_at_fault():
    wide = [
        SensorSpec(name, "accelerometer", "strip.sensor", axes, np.full(len(axes), 0.1))
        for name, axes in (("a", ("x", "y")), ("b", ("x", "y")), ("c", ("x", "z")), ("d", ("x",)))
    ]
    channels = Channels((ENCODER, *wide), ["encoder", "a", "b", "c", "d"])
    assert channels.wide == [(1, 2), (3, 4), (5, 6)]
    whole = [one for one in rearrangements(channels, channels.everybody).all if len(one.channels) > 2]
    (swap,) = whole  # c looks another way, d has but one
    assert swap.channels == (1, 2, 3, 4)
    np.testing.assert_array_equal(np.arange(8.0)[swap.source] * swap.sign, [0, 3, 4, 1, 2, 5, 6, 7])
    assert not [one for one in rearrangements(channels, frozenset({1, 2, 3})).all if len(one.channels) > 2]


@pytest.mark.parametrize("beyond_middle", [0.2, -0.6])  # at the limit now and then, or all the time
@pytest.mark.parametrize("end", [np.minimum, np.maximum])
@pytest.mark.parametrize("offset", [-1.8, -1.0, 0.0, 1.0])
def test_a_channel_is_saturated_at_the_end_at_which_it_stays_whatever_its_sign(end, offset, beyond_middle):
    """Only ends away from zero were seen: not the lower one of a gauge that a weight bends upwards."""
    expected = 1.0 + 0.5 * np.sin(2 * np.pi * 6.0 * DT * np.arange(60)) + offset
    limit = 1.0 + offset + (beyond_middle if end is np.minimum else -beyond_middle)
    window = SimpleNamespace(
        y=end(expected, limit)[:, None], halves=lambda x: np.array([x[:30].sum(), x[30:].sum()])
    )
    without, with_it = (
        SimpleNamespace(
            predicted=expected[:, None], variance=np.full((60, 1), 1e-4),
            total=lambda _, total=total: np.full(2, total), spread=lambda _: 1.0,
        )
        for total in (60.0, 2000.0)
    )  # fmt: skip
    found = explain_by_saturation(0, without, with_it, window, 1e-4)
    assert found is not None and found.words == f"is saturated at {abs(limit):.3g}"
    assert (found.gain > 1900.0).all()


def test_a_sensor_that_speaks_no_more_is_suspected_no_more():
    """Unplugged with its last word a large one, it kept all the others in question for ever."""
    suspicion = Suspicion()

    def note(tick, **normalised):
        said = [Verdict(name, DT * tick, True, np.zeros(1), z) for name, z in normalised.items()]
        suspicion.note(View(DT * tick, np.ones(2), None, (), said, np.ones(2)), tick, (), ())

    for tick in range(1, 60):
        note(tick, gauge=2.0, encoder=0.9)
    assert suspicion.first_tick
    for tick in range(60, 560):
        note(tick, encoder=0.9)
    assert not suspicion.first_tick
