"""Consistency: normalised squares against closed forms and chance, filters against truths they model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from flexarm_bringup.consistency.command import MACHINES, PERIODS, RUNS, jobs
from flexarm_bringup.consistency.drawn_truth import DrawnTruth, root_of
from flexarm_bringup.consistency.monte_carlo import (
    STATE,
    Bench,
    Drawing,
    DrawnResult,
    full_square,
    run_drawing,
)
from flexarm_bringup.consistency.nees import Square, band, mean_of, normalised_square
from flexarm_bringup.consistency.observables import Observables, TrueArm
from flexarm_bringup.consistency.page import build_page
from flexarm_bringup.consistency.rig_run import NOMINAL, SOFT, RigJob, run_rig_job
from flexarm_bringup.tasks.task import find_task
from flexarm_bringup.tasks.task_for import task_for
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.state.process import ProcessModel
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

MATCHED = 1e-8  # of the scale of the motion; nothing but rounding separates filter and truth


def test_square_of_a_regular_covariance_is_the_mahalanobis_distance() -> None:
    e, S = np.array([1.0, -2.0, 0.5]), np.array([[4.0, 1.0, 0.0], [1.0, 3.0, 0.5], [0.0, 0.5, 2.0]])
    square = normalised_square(e, S)
    assert square.rank == 3
    assert square.value == pytest.approx(e @ np.linalg.inv(S) @ e)


def test_square_leaves_out_what_cannot_move_and_what_says_nothing_of_its_own() -> None:
    S = np.diag([4.0, 0.0, 1e-6, 9e-12])  # metres: a direction that is fixed; then strains
    square = normalised_square(np.array([2.0, 5.0, 7.0, 3e-6]), S, (slice(0, 3), slice(3, 4)))
    assert square == Square(pytest.approx(1.0 + 1.0), 2)


def test_squares_of_more_observables_than_coordinates_are_one_per_coordinate() -> None:
    rng = np.random.default_rng(3)
    H = rng.standard_normal((7, 4))
    squares = [normalised_square(H @ rng.standard_normal(4), H @ H.T) for _ in range(500)]
    assert {square.rank for square in squares} == {4}
    assert band(2000).holds(mean_of(squares))


def test_band_is_that_of_printed_tables() -> None:
    found = band(100)
    assert (found.low * 100, found.high * 100) == pytest.approx((74.222, 129.561), abs=5e-4)


def test_mean_of_nothing_is_not_a_number() -> None:
    assert np.isnan(mean_of([]))


def test_square_of_a_state_does_not_mind_its_units() -> None:
    rng = np.random.default_rng(5)
    root = rng.standard_normal((4, 4))
    P, e, scale = root @ root.T, rng.standard_normal(4), np.array([1e-6, 1.0, 1e5, 1e-9])
    expected = e @ np.linalg.inv(P) @ e
    assert full_square(scale * e, P * np.outer(scale, scale)).value == pytest.approx(expected)


@pytest.fixture(scope="module")
def bench() -> Bench:
    return Bench(task_for("single_link"))


def test_strains_change_with_a_share_of_the_sag_as_the_filter_is_told() -> None:
    tree = ReducedTree(load_config(find_manipulator("serial_6r")), use_compiler=False)
    model = linearize(tree, np.array([0.0, 0.578, -0.136, 0.0, 1.127, 0.0]))
    config = EstimatorConfig(sag_modes=7, sag_share=0.5)
    process = ProcessModel(model, config, None, tree.borne(model.q0))
    rows = [i for i, name in enumerate(model.outputs.names) if name.endswith(".strain")]
    observables = Observables(model, tree, [model.outputs.names[i] for i in rows], config)
    w, told = process.layout.w, process.system.C[rows, process.layout.w.start]
    x, P = np.zeros(process.layout.n_x), np.zeros((process.layout.n_x,) * 2)
    x[: model.n], P[w, w] = model.xi0, 1.0
    truth = TrueArm(np.zeros(model.n_theta), np.eye(4), np.zeros(len(rows)))
    before, strain = observables.compare(truth, x, P, w), observables.compare(truth, x, P, w).parts[3]
    x[w] = 0.3
    after = observables.compare(truth, x, P, w)
    assert abs(told).max() > 1e-6
    np.testing.assert_allclose((before.e - after.e)[strain], 0.3 * told, atol=1e-15)
    np.testing.assert_allclose(after.S[strain, strain], np.outer(told, told), atol=1e-20)


def test_observables_change_as_their_jacobian_says(bench: Bench) -> None:
    gauges = [name for name in bench.model.outputs.names if name.startswith("root_strain")]
    observables = Observables(bench.model, ReducedTree(bench.config), gauges)
    x = bench.start.copy()
    x[0] = 0.4
    truth = TrueArm(np.zeros(1), np.eye(4), np.zeros(1))
    for i in range(bench.model.n):
        step = 1e-5
        low, high = x.copy(), x.copy()
        low[i], high[i] = x[i] - step, x[i] + step
        pair = [observables.compare(truth, each, np.eye(x.size)).e for each in (low, high)]
        slope = (pair[0] - pair[1]) / (2 * step)  # of z; e falls as z grows
        P = np.zeros((x.size, x.size))
        P[i, i] = 1.0
        S = observables.compare(truth, x, P).S
        position = [*range(4), 7]  # the rotation's error is not additive
        expected = np.outer(slope, slope)[np.ix_(position, position)]
        np.testing.assert_allclose(S[np.ix_(position, position)], expected, atol=1e-6, rtol=1e-5)


def assert_is_exact(bench: Bench, steps: int) -> None:
    t, tau, drawn = bench.draw(steps, None)
    estimator = bench.new_estimator()
    x = np.array([
        estimator.step(samples, torque, float(now)).x
        for now, torque, samples in zip(t, tau, drawn.samples, strict=True)
    ])  # fmt: skip
    layout = bench.parts.layout
    for part in (layout.theta, layout.eta, layout.theta_dot, layout.eta_dot):
        assert abs(x - drawn.x)[:, part].max() <= MATCHED * abs(drawn.x[:, part]).max()
    inertia = bench.model.M.diagonal()[: layout.n_theta]
    assert (abs(x[:, layout.d]) <= MATCHED * inertia).all()  # against 1 rad/s^2


def test_noise_free_run_is_exact(bench: Bench) -> None:
    assert_is_exact(bench, 100)


@pytest.mark.slow
@pytest.mark.parametrize("name", MACHINES)
def test_noise_free_runs_of_every_machine_are_exact(name: str) -> None:
    assert_is_exact(Bench(task_for(name)), 200)


def test_filter_is_consistent_on_a_truth_drawn_from_its_model() -> None:
    (result,) = run_drawing(Drawing(task_for("single_link"), runs=60, steps=30))
    assert set(result.means) == {STATE, "encoder", "root_strain", "tip_accelerometer", "camera"}
    assert result.outside == []


def test_a_bias_drawn_beyond_its_limit_is_no_fault_of_the_filter(tmp_path: Path) -> None:
    """One bridge of 300 began at 1.03 times its limit: the state of a sound filter had a NEES of 1.6."""
    text = find_manipulator("single_link").read_text(encoding="utf8")
    arm = tmp_path / "single_link.yaml"
    assert text.count("limit: 200 ustrain}") == 1  # sigma 70
    arm.write_text(text.replace("limit: 200 ustrain}", "limit: 90 ustrain}"), encoding="utf8")
    (result,) = run_drawing(Drawing(task_for(str(arm)), runs=60, steps=30))
    assert result.outside == []


@pytest.mark.slow
@pytest.mark.parametrize("name", MACHINES)
def test_filter_of_every_machine_is_consistent_on_a_truth_drawn_from_its_model(name: str) -> None:
    (result,) = run_drawing(Drawing(task_for(name), RUNS, PERIODS))
    assert result.outside == []


def test_a_truth_begins_as_the_filter_believes_what_hangs_together_too() -> None:
    """Of sprung gears of which sag was drawn apart from position a sound filter had a NEES of 1.12."""
    bench = Bench(task_for("single_link"))
    P0 = bench.parts.process.P0
    pair = np.ix_([0, 1], [0, 1])
    bench.parts.process.P0 = correlated = P0.copy()
    correlated[0, 1] = correlated[1, 0] = 0.9 * np.sqrt(P0[0, 0] * P0[1, 1])
    bench.truth = SimpleNamespace(draw=lambda t, tau, start, first, rng: start)  # type: ignore[assignment]
    rng = np.random.default_rng(5)
    starts = np.array([bench.draw(1, rng)[2] for _ in range(400)])
    drawn = np.cov(starts.T)
    assert drawn[pair] == pytest.approx(correlated[pair], rel=0.2)
    assert drawn.diagonal() == pytest.approx(P0.diagonal(), rel=0.3)


def test_a_root_is_one_of_singular_covariances_too_and_plain_without_correlation() -> None:
    A = np.random.default_rng(1).standard_normal((5, 3)) * [[1e-6], [1.0], [1e3], [0.0], [1.0]]
    root = root_of(A @ A.T)
    scale = np.outer(*(2 * [np.linalg.norm(A, axis=1)]))
    assert abs(root @ root.T - A @ A.T).max() <= 1e-12 * scale.max()
    variances = np.array([4.0, 0.0, 1e-12])
    assert (root_of(np.diag(variances)) == np.diag(np.sqrt(variances))).all()


def test_filter_that_believes_too_little_noise_is_found_out(bench: Bench) -> None:
    settings = replace(bench.settings, modal_force=bench.settings.modal_force / 3)
    rng = np.random.default_rng(2)
    squares = []
    for _ in range(10):
        t, tau, drawn = bench.draw(30, rng)
        estimator = Estimator(bench.model, ReducedTree(bench.config), bench.config.sensors, settings)
        for now, torque, samples in zip(t, tau, drawn.samples, strict=True):
            estimate = estimator.step(samples, torque, float(now))
        squares.append(full_square(drawn.x[-1] - estimate.x, estimate.P))
    assert mean_of(squares) > band(sum(square.rank for square in squares)).high


def test_drawn_truth_moves_as_the_model_says_without_noise(bench: Bench) -> None:
    """A step of four periods is four steps of one period, for torques that hold."""
    truth = DrawnTruth(bench.parts, {"camera": 1})
    fine, coarse = np.arange(9) * bench.dt, np.arange(3) * 4 * bench.dt
    start = bench.start + 0.01
    start[bench.parts.layout.p] = 0.0  # a step is of first order in what is learned
    ends = [
        truth.draw(t, np.full((t.size, 1), 0.7), start, t[1] - t[0], None).x[-1]
        for t in (fine[1:], coarse[1:])
    ]
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-10, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("name", MACHINES)
def test_estimator_knows_how_wrong_it_is_on_the_simulated_arm(name: str) -> None:
    results = [run_rig_job(RigJob(task_for(name), condition))[0] for condition in (NOMINAL, SOFT)]
    missed = [check for check in build_page(results, [], 0).checks if not check.passed]
    assert missed == []


def test_an_arm_is_asked_with_the_settings_of_its_preset(tmp_path: Path) -> None:
    moves = tmp_path / "moves.yaml"
    given = find_task("planar_3rrr").read_text(encoding="utf-8")
    own = "preset_settings: {geared: {estimator: {modal_force: 0.123}}}"
    moves.write_text(f"{given}\n{own}\n", encoding="utf-8")
    todo = jobs([str(moves)], 1, 1)
    assert {job.task.make("estimator", EstimatorConfig).modal_force for job in todo} == {0.123}


def test_page_says_which_bound_is_missed() -> None:
    low, high = band(100), band(1000)
    drawn = DrawnResult("single_link", {STATE: 1.0, "camera": 2.0}, {STATE: low, "camera": high})
    page = build_page([], [drawn], 7)
    assert not page.passed
    assert [check.found for check in page.checks] == ["camera"]
    assert "7 runs" in page.to_text()


def test_files_of_one_machine_are_told_apart_and_a_machine_alone_has_its_name(tmp_path: Path) -> None:
    given = Path(find_task("single_link")).read_text(encoding="utf-8")
    for name in ("slow", "fast"):
        (tmp_path / f"{name}.yaml").write_text(given, encoding="utf-8")
    slow, fast = (str(tmp_path / f"{name}.yaml") for name in ("slow", "fast"))
    todo = jobs([slow, fast, "planar_3rrr", slow], 1, 1)
    wanted = [f"single_link, {slow}", f"single_link, {fast}", "planar_3rrr", f"single_link, {slow} #2"]
    assert list(dict.fromkeys(job.label for job in todo)) == wanted
    assert [job.label for job in jobs(["single_link"], 1, 1)] == ["single_link"] * 3
