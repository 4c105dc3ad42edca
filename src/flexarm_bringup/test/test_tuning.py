"""Tuning by maximum likelihood: noise that was put into a record comes out of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flexarm_bringup import tune
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.consistency.bag_epochs import Epochs, order_epochs, read_epochs
from flexarm_bringup.consistency.knobs import PROCESS, Noise, Parameter, make_knobs, turn
from flexarm_bringup.consistency.monte_carlo import START_BEFORE, Bench
from flexarm_bringup.consistency.recording import open_recording, run_estimator
from flexarm_bringup.consistency.search import DEAR
from flexarm_bringup.consistency.tuning import Tuned, Tuner, curvature, spreads, told_by
from flexarm_bringup.consistency.tuning_page import Judgement, build_page, doubtful, worth_checks, worth_table
from flexarm_bringup.tasks.task_for import task_for
from flexarm_bringup.tune import SETTLING
from flexarm_estimator.likelihood import Epoch, Likelihood
from flexarm_estimator.measurement import Measurement
from flexarm_model.tree.reduced_tree import ReducedTree

GOLDEN = Path(__file__).parents[3] / "tests" / "golden"


@pytest.fixture(scope="module")
def bench() -> Bench:
    return Bench(task_for("single_link"))


def noise_of(bench: Bench) -> Noise:
    return Noise(bench.settings, bench.config.sensors)


def record_of(bench: Bench, steps: int, seed: int) -> Epochs:
    t, tau, drawn = bench.draw(steps, np.random.default_rng(seed))
    epochs = tuple(
        Epoch(float(now), np.append(torque, 1.0), {sample.sensor: sample for sample in samples})
        for now, torque, samples in zip(t, tau, drawn.samples, strict=True)
    )
    return Epochs((bench.model,), epochs, -START_BEFORE)


def test_turning_a_knob_multiplies_settings_and_sigmas(bench: Bench) -> None:
    noise = noise_of(bench)
    knobs = make_knobs(noise)
    p = np.zeros(len(knobs))
    names = [knob.name for knob in knobs]
    p[names.index("modal_force")], p[names.index("camera")] = np.log(3.0), np.log(0.5)
    turned = turn(noise, knobs, p)
    assert turned.settings.modal_force == pytest.approx(3.0 * noise.settings.modal_force)
    assert replace(turned.settings, modal_force=noise.settings.modal_force) == noise.settings
    camera = next(spec for spec in turned.sensors if spec.name == "camera")
    np.testing.assert_allclose(camera.sigma, [2.5e-4] * 3 + [2.5e-3] * 3)


def test_sensors_alike_share_a_knob() -> None:
    arm = Bench(task_for("planar_3rrr"))
    names = [knob.name for knob in make_knobs(noise_of(arm))]
    assert "encoder_1, encoder_2, encoder_3" in names
    assert "sag_error" not in names


def test_a_sensor_that_tells_its_own_covariance_has_no_knob(bench: Bench) -> None:
    """It read "does not tell it: stays as before" beside a NIS of 0.1: turning the knob changed nothing."""
    noise = noise_of(bench)
    names = {knob.name for knob in make_knobs(noise)}
    assert names - {knob.name for knob in make_knobs(noise, ["camera"])} == {"camera"}


def test_knobs_stay_inside_what_the_settings_allow(bench: Bench) -> None:
    noise = Noise(replace(bench.settings, modal_force=500.0), bench.config.sensors)
    knob = next(knob for knob in make_knobs(noise) if knob.name == "modal_force")
    assert knob.limits[1] == pytest.approx(np.log(2.0))  # 1000 is the largest allowed


def test_curvature_and_spread_of_a_parabola_are_its_own() -> None:
    covariance = np.array([[0.04, 0.01], [0.01, 0.09]])
    H = np.linalg.inv(covariance)
    found = curvature(lambda p: float(p @ H @ p) / 2, np.zeros(2))
    np.testing.assert_allclose(found, H, rtol=1e-8)
    np.testing.assert_allclose(spreads(found), [0.2, 0.3], rtol=1e-8)


def test_spread_of_a_flat_direction_is_huge() -> None:
    found = spreads(np.diag([25.0, 0.0]))
    assert found[0] == pytest.approx(0.2)
    assert found[1] > 100.0


def test_of_two_parameters_that_do_the_same_one_is_fixed_and_the_other_told() -> None:
    H = np.array([[100.0, 100.0, 0.0], [100.0, 100.0, 0.0], [0.0, 0.0, 25.0]])
    H[1, 1] += 1e-9
    assert len(kept := told_by(H, [True, True, True])) == 2
    assert 2 in kept
    assert told_by(H, [False, True, True]) == [1, 2]
    assert told_by(np.zeros((2, 2)), [True, True]) == []


def test_torques_act_from_their_stamp_on_and_models_are_used_from_theirs() -> None:
    samples = [Measurement("encoder", t, np.zeros(1)) for t in (0.0, 0.01, 0.02)]
    torques = [(0.0, np.array([1.0])), (0.015, np.array([2.0]))]
    epochs = list(order_epochs(samples, torques, [0.0, 0.01], 1))
    assert [epoch.t for epoch in epochs] == [0.0, 0.01, 0.015, 0.02]
    assert [epoch.u[0] for epoch in epochs] == [0.0, 1.0, 1.0, 2.0]
    assert [epoch.parts for epoch in epochs] == [0, 1, 1, 1]
    assert [len(epoch.samples) for epoch in epochs] == [1, 1, 0, 1]


def test_a_setting_too_small_to_matter_is_not_put_back_where_the_record_refutes_it(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was, for its likelihood is flat there; and the accelerometer's sigma made up for what it could."""
    count, truth = 1000, 0.03**2
    start = replace(bench.settings, modal_force=0.05)

    def likelihood(tuner: Tuner, noise: Noise, **span: float) -> Likelihood:
        sigma = next(spec.sigma[0] for spec in noise.sensors if spec.name == "tip_accelerometer")
        variance = float(sigma**2 + noise.settings.modal_force**2)
        return Likelihood(-count / 2 * (np.log(variance) + truth / variance))

    monkeypatch.setattr(Tuner, "likelihood", likelihood)
    tuner = Tuner(record_of(bench, 2, 1), ReducedTree(bench.config), bench.settings, settling=0.0)
    tuned = tuner.tune(Noise(start, bench.config.sensors), np.inf)
    by_name = {parameter.name: parameter for parameter in tuned.parameters}
    assert by_name["modal_force"].verdict == "less"
    (line,) = doubtful(tuned.parameters)
    assert line == "# modal_force: the record tells only that it is less than 0.05, not by how much"
    page = build_page(
        Path("bag"), Noise(start, bench.config.sensors), tuned, 2 * [Judgement(*2 * [Likelihood(0.0)], None)]
    )
    assert line in page.data["yaml"]
    assert by_name["tip_accelerometer"].after ** 2 + by_name["modal_force"].after ** 2 == pytest.approx(
        truth, rel=3 * (2 / count) ** 0.5
    )
    assert likelihood(tuner, tuned.noise).value > -count / 2 * (np.log(truth) + 1.0) - DEAR
    assert {by_name[name].verdict for name in ("acceleration_noise", "encoder", "camera")} == {"flat"}
    assert tuned.noise.settings.acceleration_noise == start.acceleration_noise


@pytest.mark.slow
def test_noise_that_was_put_in_comes_out_within_its_uncertainty() -> None:
    """3 sigma; the search begins at half to three times the truth."""
    noise = {"modal_force": 0.05, "acceleration_noise": 0.3}
    bench = Bench(replace(task_for("single_link"), settings={"estimator": noise}))
    truth = {name: getattr(bench.settings, name) for name in PROCESS}  # the bench has some of its own
    truth |= {spec.name: float(spec.sigma[0]) for spec in bench.config.sensors}
    wrong = {"root_strain": 0.5, "camera": 2.0}
    sensors = tuple(
        replace(spec, sigma=spec.sigma * wrong.get(spec.name, 1.0)) for spec in bench.config.sensors
    )
    start = Noise(replace(bench.settings, modal_force=0.13, acceleration_noise=0.6), sensors)
    tuner, other = (
        Tuner(record_of(bench, 400, seed), ReducedTree(bench.config), bench.settings, settling=0.1)
        for seed in (4, 5)
    )
    tuned = tuner.tune(start, np.inf)
    told = {parameter.name: parameter for parameter in tuned.parameters if parameter.verdict == "told"}
    well_told = {"modal_force", "acceleration_noise", "encoder", "root_strain", "camera"}
    assert well_told <= set(told)
    assert all(told[name].spread < 0.2 for name in well_told)
    for name, parameter in told.items():
        assert abs(np.log(parameter.after / truth[name])) <= 3.0 * parameter.spread
    for each in (tuner, other):  # of another run, too
        assert each.likelihood(tuned.noise).value > each.likelihood(start).value


@pytest.mark.slow
def test_what_the_record_does_not_tell_is_named_and_kept() -> None:
    """Motion excites modes like any other force: where modal_force is large, its share cannot be told."""
    bench = Bench(replace(task_for("single_link"), settings={"estimator": {"modal_force": 2.0}}))
    start = noise_of(bench)
    tuner = Tuner(record_of(bench, 150, 6), ReducedTree(bench.config), bench.settings, settling=0.1)
    tuned = tuner.tune(start, np.inf)
    by_name = {parameter.name: parameter for parameter in tuned.parameters}
    assert by_name["motion_acceleration"].verdict == "flat"
    assert tuned.noise.settings.motion_acceleration == start.settings.motion_acceleration


def test_page_gives_yaml_only_of_what_has_changed(bench: Bench) -> None:
    before = noise_of(bench)
    sensors = tuple(
        replace(spec, sigma=spec.sigma * 2) if spec.name == "encoder" else spec for spec in before.sensors
    )
    after = Noise(replace(before.settings, modal_force=0.5), sensors)
    parameters = (
        Parameter("modal_force", "1", 0.13, 0.5, 0.1, "told"),
        Parameter("disturbance_drift", "1", 0.03, 7.0, 9.0, "flat"),
    )
    same = Judgement(Likelihood(-3.0, {"encoder": 2.0}, {"encoder": 4}), Likelihood(-5.0), 1e-5)
    better = Judgement(Likelihood(4.0, {"encoder": 4.0}, {"encoder": 4}), Likelihood(1.0), 5e-6)
    page = build_page(Path("bag"), before, Tuned(parameters, after, 9), [same, better])
    text = page.to_text()
    assert page.data["yaml"] == [
        "settings: {estimator: {modal_force: 0.5}}",
        "sensors.encoder.sigma: 2 times what it is: [4e-05] in SI",
    ]
    assert page.passed
    assert "does not tell it" in text
    assert "+7.0" in text
    assert "-5.0" in text


def test_likelihood_is_that_of_the_filter_that_the_settings_name() -> None:
    """The linear one cannot follow the ramps of the 3RRR: it takes what it leaves out for a bad camera."""
    recording = open_recording(GOLDEN / "planar_3rrr" / "bag")
    record, tree = read_epochs(recording), ReducedTree(recording.config)
    linear = replace(recording.settings, filter="linear")
    by_linear, by_own = (
        Tuner(record, tree, settings, SETTLING).likelihood(Noise(settings, recording.config.sensors))
        for settings in (linear, recording.settings)
    )
    assert recording.settings.filter == "corrected"
    assert by_own.value > by_linear.value + 100.0
    assert by_linear.nis()["camera"] > 3.0
    assert by_own.nis()["camera"] < 1.5


def test_other_sigmas_count_also_where_messages_repeat_those_of_the_description() -> None:
    """The tip's error after tuning was that of the sigmas before, but for the encoder's."""
    recording = open_recording(GOLDEN / "single_link" / "bag")
    sigmas = {spec.name: 100 * spec.sigma for spec in recording.config.sensors}
    before, after = (
        {
            report.name: report.normalised
            for report in run_estimator(recording, sigmas=each)[40].estimate.sensors
        }
        for each in (None, sigmas)
    )
    assert set(before) == {"encoder", "root_strain", "tip_accelerometer", "camera"}
    assert all(0.0 < after[name] < 0.1 * before[name] for name in before)


@pytest.mark.parametrize(
    ("held", "tip", "reason"),
    [
        (-5.25, 1e-5, "log-likelihood, second half (held out) is -5.25, -5.00 before"),
        (-np.inf, 1e-5, "log-likelihood, second half (held out) is -inf, -5.00 before"),
        (1.0, 1.2e-5, "tip error is 12.00 um RMS, 10.00 before"),
    ],
)
def test_what_makes_the_held_out_half_or_the_tip_worse_is_not_proposed(
    held: float, tip: float, reason: str, bench: Bench
) -> None:
    before = noise_of(bench)
    after = Noise(replace(before.settings, modal_force=0.5), before.sensors)
    tuned = Tuned((Parameter("modal_force", "1", 0.13, 0.5, 0.1, "told"),), after, 9)
    choices = [
        Judgement(Likelihood(-3.0), Likelihood(-5.0), 1e-5),
        Judgement(Likelihood(4.0), Likelihood(held), tip),
    ]
    page = build_page(Path("bag"), before, tuned, choices)
    assert page.data["yaml"] == []
    assert page.remarks["YAML to paste"] == [f"nothing: {reason}"]
    assert not page.passed  # exit code 1


@pytest.mark.parametrize(("halves", "name"), [((-np.inf, 1.0), "first"), ((1.0, -np.inf), "second")])
def test_a_bag_of_which_a_half_cannot_be_computed_is_refused(halves: tuple[float, float], name: str) -> None:
    """With -inf before and after a proposal was no less likely."""
    before = Judgement(*map(Likelihood, halves), None)
    with pytest.raises(BagError, match=f"cannot be run through its {name} half"):
        tune.refuse_unlikely(before, Path("bag"))
    (check,) = worth_checks([Judgement(Likelihood(1.0), Likelihood(-np.inf), None)] * 2)
    assert not check.passed


def test_a_bag_with_a_pause_is_refused_with_its_place() -> None:
    """A jump of the arm between two runs in one bag was counted as noise."""
    t = [*np.arange(0.0, 1.0, 0.005), *np.arange(1.5, 2.5, 0.005)]
    record: Any = SimpleNamespace(epochs=[SimpleNamespace(t=at) for at in t])
    with pytest.raises(BagError, match=r"bag: \+0.505 s from one sample to the next at 0.995 s"):
        tune.middle_of(record, Path("bag"), 0.1)
    assert tune.middle_of(record, Path("bag"), 0.6) == pytest.approx(1.2475)


@pytest.mark.parametrize(
    ("truth", "error"), [({}, None), ({55: np.zeros(3)}, None), ({10: np.zeros(3)}, 0.2)]
)
def test_a_choice_is_judged_by_the_tip_where_the_truth_is_of_its_instants(
    truth: dict[int, np.ndarray], error: float | None, bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    T = np.eye(4)
    T[2, 3] = 0.2
    told = [
        SimpleNamespace(stamp_ns=at, estimate=SimpleNamespace(age=0.04 * at, T_world_tip=T))
        for at in range(11)
    ]
    monkeypatch.setattr(tune, "run_estimator", lambda *_, **__: told)
    tuner: Any = SimpleNamespace(likelihood=lambda *_, **__: Likelihood(-3.0))
    recording: Any = SimpleNamespace(true_tip=lambda: truth)
    judged = tune.judge(recording, tuner, noise_of(bench), 1.0)
    assert judged.tip == (error if error is None else pytest.approx(error))
    notes = worth_table([judged, judged]).notes
    assert notes == ([] if error else ["no tip error: the bag has no truth at the stamps of the estimates"])
