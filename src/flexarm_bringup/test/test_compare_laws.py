"""``flexarm compare``: what it reads, what it plans and judges, and one run end to end."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flexarm_bringup.cli import main
from flexarm_bringup.compare_laws import command, sweep
from flexarm_bringup.compare_laws.against_shapers import rivalries
from flexarm_bringup.compare_laws.at_rest import floors_at_rest
from flexarm_bringup.compare_laws.checks import all_checks
from flexarm_bringup.compare_laws.comparison import Comparison
from flexarm_bringup.compare_laws.judged import CompareResult, LegFigures, TrueRecord, judge_leg
from flexarm_bringup.compare_laws.legs import compared_legs
from flexarm_bringup.compare_laws.page import build_page
from flexarm_bringup.compare_laws.runs import CompareJob, run_compare_job, with_effort
from flexarm_bringup.compare_laws.schemes import LQR, MPC, PD, SERVO, WORST, Case, plan_case, sample_motion
from flexarm_bringup.compare_laws.sweep import Sweep, SweepPoint, shortest
from flexarm_bringup.compare_laws.sweep_page import sweep_tables
from flexarm_bringup.page.report import Table
from flexarm_bringup.tasks.course import Leg
from flexarm_bringup.tasks.task import Task, load_task
from flexarm_bringup.tasks.task_check import check_against_arm
from flexarm_bringup.tasks.task_for import task_for
from flexarm_controller.limits import limits_of
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.strict_yaml import ConfigError
from flexarm_model.tree.reduced_tree import ReducedTree

TASK = """
format: flexarm-moves/1
manipulator: single_link
presets: [geared]
wait: 1.2 s
watch: {from: 100 ms, to: 1.1 s, below: 20 Hz, tolerance: 0.5 mm}
moves: {out: {by: {base.rz: 10 deg}, duration: 0.5 s, ramps: [0.3 s, 96 ms]}}
"""


@pytest.fixture(scope="module")
def case() -> Case:
    task = task_for("single_link")
    tree = ReducedTree(load_config(find_manipulator("single_link"), "geared"))
    return plan_case(task, compared_legs(tree, task, np.zeros(1)), is_quick=True)


def result(
    law: str, motion: str, residual: float, error: float = 0.0, is_scarce: bool = False
) -> CompareResult:
    legs = (LegFigures(residual, 0.1, 1.1, 0.0, 0.5, 1e-4),)
    return CompareResult("geared", error, motion, law, is_scarce, legs, "", np.zeros(1), np.zeros(1))


def test_section_compare_of_a_moves_file_is_read_and_its_mistakes_are_named(tmp_path: Path) -> None:
    path = tmp_path / "arm.yaml"
    path.write_text(TASK + "compare: {signal: accelerometer, worst_db: -30, slowest: 1.2}\n")
    compare = load_task(path).compare
    assert compare == Comparison(signal="accelerometer", worst_db=-30.0, slowest=1.2)
    path.write_text(TASK + "compare: {signal: nose}\n")
    with pytest.raises(ConfigError, match="nose"):
        load_task(path)


def test_every_motion_takes_the_same_time_from_start_to_goal(case: Case) -> None:
    goal = np.radians([10.0])
    assert {"worst profile", "best trapezoid", "ZV", "ZVD", "EI", "three-hump EI"} <= case.motions.keys()
    for by_leg in case.motions.values():
        motion = by_leg["out"]
        assert motion.duration == pytest.approx(1.0)
        sampled = sample_motion(motion, 0.005)
        np.testing.assert_allclose(sampled.theta[[0, -1]], [[0.0], goal], atol=1e-12)
        np.testing.assert_allclose(sampled.theta_dot[[0, -1]], 0.0, atol=1e-9)


def test_schemes_put_each_motion_on_the_ideal_servo_and_under_joint_pd(case: Case) -> None:
    pairs = [(scheme.law, scheme.motion) for scheme in case.schemes()]
    assert len(set(pairs)) == len(pairs)
    assert {(law, name) for law in (SERVO, PD) for name in case.motions} <= set(pairs)
    assert {(LQR, WORST), (MPC, WORST), (MPC, case.chosen)} <= set(pairs)
    # peak of the worst profile: 3.07 rad/s^2 on 0.365 kg m^2 (seed 002)
    assert case.scarce()[0].effort == pytest.approx([0.5 * 3.07 * 0.365], rel=0.01)


def test_time_optimal_bound_of_the_strip_is_shorter_than_its_first_period(case: Case) -> None:
    optimum = case.planned["out"].optimum
    assert optimum is not None
    assert 0.08 < optimum.duration < 1 / 5.23  # s: rigid bang-bang at 28 N m takes 0.095 s


def test_scarce_torque_changes_the_limit_and_nothing_else() -> None:
    config = load_config(find_manipulator("single_link"), "geared")
    weak = with_effort(config, np.array([0.5]))
    assert limits_of(weak).effort == [0.5]
    assert limits_of(weak).effort_rate == limits_of(config).effort_rate
    assert with_effort(config, None) is config


def test_a_ringing_tip_is_judged_by_what_is_left_and_when_it_stays_in_the_ball() -> None:
    task = replace(task_for("single_link"), compare=Comparison())
    t = np.arange(0.0, 4.0, 0.005)
    along = np.clip((t - 0.5) / 1.0, 0.0, 1.0) * 0.1
    omega, start = 2 * np.pi * 5.0, 2e-3
    ring = np.where(t > 1.5, start * np.exp(-(t - 1.5)) * np.cos(omega * (t - 1.5)), 0.0)
    tip = np.stack([along, ring, 0 * t], axis=1)
    record = TrueRecord(t, tip, np.zeros((t.size, 1)), np.full((t.size, 1), 0.3), np.full((t.size, 1), 1e-4))
    leg = judge_leg(record, Leg("out", 0.5, 1.5), task, np.zeros(3), np.array([0.1, 0.0, 0.0]))
    share = np.sqrt((np.exp(-0.2) - np.exp(-4.2)) / 8.0)  # of the first amplitude, RMS over the window
    assert leg.residual == pytest.approx(start * omega**2 * share, rel=0.02)
    assert leg.settling == pytest.approx(np.log(2e-3 / task.watch.tolerance), abs=0.1)  # half a swing
    assert leg.moving == pytest.approx(1.0 + leg.settling - 0.005, abs=0.006)  # 0.5 mm take 5 ms
    assert (leg.peak_torque, leg.peak_strain) == (0.3, 1e-4)
    assert leg.rest_error < 5e-4


def test_bounds_are_judged_row_by_row_and_a_worse_mpc_misses_them() -> None:
    task: Task = task_for("single_link")
    rows = [
        result(SERVO, WORST, 2.0), result(MPC, WORST, 0.05), result(MPC, "ZVD", 0.03),
        *(result(law, "ZVD", 0.06, error) for law in (SERVO, PD) for error in (-0.1, 0.1)),
        *(result(MPC, WORST, 0.05, error) for error in (-0.1, 0.1)),
        result(LQR, WORST, 0.3, is_scarce=True), result(MPC, WORST, 0.05, is_scarce=True),
    ]  # fmt: skip
    checks = all_checks(task, rows)
    assert len(checks) == 6 and all(check.passed for check in checks)
    worse = [replace(r, legs=(replace(r.legs[0], residual=0.2),)) if r.law == MPC else r for r in rows]
    assert not any(check.passed for check in all_checks(task, worse))


def test_mpc_is_held_to_shapers_that_have_motors_and_the_others_are_told() -> None:
    rows = [
        *(result(MPC, WORST, left, error) for error, left in ((-0.1, 0.05), (0.1, 0.03))),
        *(result(PD, "ZVD", left, error) for error, left in ((-0.1, 0.10), (0.1, 0.20))),
        *(result(PD, "EI, two modes", left, error) for error, left in ((-0.1, 0.15), (0.1, 0.15))),
        *(result(SERVO, "ZVD", 0.005, error) for error in (-0.1, 0.1)),
    ]
    found = [(r.law, r.errors, r.shaper, round(r.gap, 2)) for r in rivalries(rows)]
    assert found == [
        (PD, (-0.1,), "ZVD", -6.02), (PD, (0.1,), "EI, two modes", -13.98),
        (PD, (-0.1, 0.1), "EI, two modes", -9.54), (SERVO, (-0.1,), "ZVD", 20.0),
        (SERVO, (0.1,), "ZVD", 15.56), (SERVO, (-0.1, 0.1), "ZVD", 20.0),
    ]  # fmt: skip
    task = replace(task_for("single_link"), compare=Comparison())
    checks = all_checks(task, [result(SERVO, WORST, 2.0), *rows])
    assert [check.passed for check in checks] == [True, True, True]


def test_shapers_that_nobody_could_follow_are_a_bound_that_is_missed() -> None:
    """Joint PD fell on every one: there was no acceptance at all, and exit code 0."""
    task, off = replace(task_for("single_link"), compare=Comparison()), (-0.1, 0.1)
    rows = [result(SERVO, WORST, 2.0), *(result(MPC, WORST, 0.1, error) for error in off)]
    fallen = [replace(result(PD, "ZVD", 0.1, error), stopped="velocity") for error in off]
    checks = all_checks(task, [*rows, *fallen])
    assert [(check.found, check.passed) for check in checks] == [("none: joint PD was stopped", False)] * 2
    once = all_checks(task, [*rows, fallen[0], result(PD, "ZVD", 0.2, 0.1)])
    assert [check.passed for check in once] == [True, False]


@pytest.mark.parametrize(
    ("bound", "left", "passed"), [(0.0, 1.9, True), (0.0, 2.1, False), (-20.0, 1.9, False)]
)
def test_a_bound_is_judged_also_where_it_is_zero_or_the_motion_no_shaper(
    bound: float, left: float, passed: bool
) -> None:
    """0 dB, and a bound on the motion that a moves file chooses, were left out without a word."""
    task = replace(task_for("single_link"), compare=Comparison(worst_db=bound, shaped_db=bound))
    rows = [result(SERVO, WORST, 2.0), result(MPC, WORST, left), result(MPC, "best trapezoid", left)]
    assert [check.passed for check in all_checks(task, rows)] == [passed, passed]
    alone = all_checks(task, rows[:2])
    assert [check.found for check in alone][1:] == ["none: no such row has ended"]


def test_a_sweep_that_cannot_be_made_says_why_and_misses_its_bound(case: Case) -> None:
    task = replace(case.task, compare=replace(case.task.compare, slowest=1.2))
    (table,), (check,) = sweep_tables(replace(case, task=task, legs=(*case.legs, *case.legs)), (Sweep(), []))
    assert "several moves" in table.notes[0] and not check.passed and "several moves" in check.found


@pytest.mark.parametrize("arm", ["rigid_four_bar", "massless_crank"])
def test_an_arm_without_modes_has_nothing_to_compare(arm: str, capsys: pytest.CaptureFixture[str]) -> None:
    """It ended in a traceback."""
    assert main(["compare", str(Path(__file__).parent / "arms" / f"{arm}.yaml"), "--quick"]) == 2
    assert "no mode is served" in capsys.readouterr().err


def test_a_signal_that_the_arm_has_no_sensor_for_is_refused() -> None:
    """Nothing was measured, and every bound was kept."""
    arm = str(Path(__file__).parent / "arms" / "rigid_four_bar.yaml")
    task = replace(
        task_for("variable_stiffness"), compare=Comparison(signal="accelerometer"), manipulator=arm
    )
    with pytest.raises(ConfigError, match="signal: 'accelerometer': the arm has no sensor of this kind"):
        check_against_arm(task)


def stopped(row: CompareResult) -> CompareResult:
    return replace(row, legs=(replace(row.legs[0], residual=0.0),), stopped="command is 100 ms old")


def test_a_run_that_was_stopped_is_told_and_wins_nothing(case: Case) -> None:
    """It stands still, so that it leaves nothing at all."""
    rows = [
        result(SERVO, WORST, 2.0), result(MPC, WORST, 0.05), result(MPC, "ZVD", 0.03),
        *(result(law, "ZVD", 0.06, error) for law in (SERVO, PD) for error in (-0.1, 0.1)),
        *(result(MPC, WORST, 0.05, error) for error in (-0.1, 0.1)),
        result(LQR, WORST, 0.3, is_scarce=True), result(MPC, WORST, 0.05, is_scarce=True),
    ]  # fmt: skip
    laws = {law: [stopped(r) if r.law == law else r for r in rows] for law in (LQR, MPC, PD)}
    checks = {law: {c.name: c for c in all_checks(case.task, changed)} for law, changed in laws.items()}
    assert not any(check.passed for check in checks[MPC].values())
    assert checks[MPC]["MPC is never stopped"].found == "4"
    missed = [check.found for check in checks[LQR].values() if not check.passed]
    assert missed == ["none: LQG was stopped"]
    unjudged = [check for name, check in checks[PD].items() if "shaper" in name]  # nothing to hold MPC to
    assert [(check.found, check.passed) for check in unjudged] == [("none: joint PD was stopped", False)] * 2
    config = replace(load_config(find_manipulator("single_link"), "geared"), fitted=())
    page = build_page(case, config, laws[MPC], None)
    assert all(page.remarks.values())  # no heading above nothing
    tables = [item for item in page.items if isinstance(item, Table)]
    notes = [note for table in tables for note in table.notes]
    assert "MPC, worst profile: command is 100 ms old" in notes
    assert "MPC, worst profile, f +10 %: command is 100 ms old" in notes
    told = [row for table in tables[:3] for row in table.rows if row[0] == "MPC"]
    assert told and all(cell is None for row in told for cell in row[2:])


def test_mpc_shakes_the_single_link_less_at_rest_than_joint_pd() -> None:
    laws = floors_at_rest(task_for("single_link"), "geared", np.radians([10.0]), (-0.1, 0.0, 0.1), (PD, MPC))
    pd, mpc = (law.floors for law in laws)
    assert all(mpc[error] < pd[error] < 0.02 for error in (-0.1, 0.0, 0.1))  # m/s^2


def test_a_direction_in_which_the_tip_cannot_move_leaves_the_noise_at_rest_a_number() -> None:
    """Its variance is zero but for rounding, which may be below it: the root of that was no number."""
    task = replace(task_for("single_link"), compare=Comparison(signal="tip"))
    errors = (-0.1, 0.0, 0.1)
    for law in floors_at_rest(task, "geared", np.radians([0.01]), errors):
        assert all(0.005 < law.floors[error] < 0.03 for error in errors), law  # m/s^2


def test_the_shaped_motion_may_be_named_and_must_exist(case: Case) -> None:
    def asked(name: str) -> Case:
        return replace(case, task=replace(case.task, compare=replace(case.task.compare, shaped=name)))

    assert asked("ZV").chosen == "ZV" != case.chosen
    with pytest.raises(
        ValueError, match=r"compare\.shaped: 'ZVZ' cannot be planned; expected one of worst profile; .*ZVD"
    ):
        _ = asked("ZVZ").chosen


def test_time_taken_is_never_less_than_that_of_the_motion(case: Case) -> None:
    scheme = case.schemes()[0]
    early = replace(result(MPC, "a", 0.1), legs=(LegFigures(0.1, -0.2, 0.3, 0.0, 0.5, 0.0),))
    late = replace(result(MPC, "b", 0.1), legs=(LegFigures(0.1, 0.1, 0.9, 0.0, 0.5, 0.0),))
    points = [SweepPoint("a", scheme, 0.5), SweepPoint("b", scheme, 0.4)]
    assert [p.arrival(r) for p, r in zip(points, [early, late], strict=True)] == [0.5, 0.9]
    assert shortest(points, [early, late]) == (points[0], 0.5)


def test_another_seed_draws_other_noise(case: Case) -> None:
    """The spread of what a draw decides could not be seen."""
    pd = replace(case.scheme(PD, WORST, case.motions[WORST]), end=2.0)  # half a second after the move
    jobs = [CompareJob(case.task, "geared", np.zeros(1), 0.0, (pd,), seed) for seed in (1, 2)]
    first, other = (run_compare_job(job)[0].residual for job in jobs)
    assert first != other == pytest.approx(first, rel=0.2)


def test_the_seed_is_given_to_every_run(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    seeds: set[int] = set()

    def run_none(jobs: Sequence[CompareJob], *_: object) -> list[CompareResult]:
        seeds.update(job.seed for job in jobs)
        raise ValueError("nothing is run")

    monkeypatch.setattr(command, "run_compare_jobs", run_none)
    assert main(["compare", "single_link", "--quick", "--seed", "7"]) == 2
    assert seeds == {7} and "nothing is run" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize("error", [0.0, -0.1, 0.1])
def test_the_time_optimal_motion_arrives_in_time_and_is_damped_where_frequencies_are_off(
    case: Case, error: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sweep, "FACTORS", (1.0,))
    point = next(p for p in sweep.plan_sweep(case).points if p.kind == sweep.LEAST_TORQUE)
    job = CompareJob(case.task, "geared", np.zeros(1), error, (point.scheme,))
    arrival = point.arrival(run_compare_job(job)[0])
    assert arrival <= (
        1.2 * point.duration if error == 0.0 else 0.75
    )  # s; never without the soft law after it


def test_a_manipulator_that_does_not_exist_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["compare", "no_such_arm"]) == 2
    assert "no_such_arm" in capsys.readouterr().err


@pytest.mark.slow
def test_the_command_compares_the_single_link_and_writes_everything(tmp_path: Path) -> None:
    files = ["--json", str(tmp_path / "c.json"), "--html", str(tmp_path / "c.html")]
    assert main(["compare", "single_link", "--quick", *files]) in (0, 1)  # 1: a bound is missed, and said
    page = json.loads((tmp_path / "c.json").read_text(encoding="utf-8"))
    nominal = [r for r in page["rows"] if r["frequency_error"] == 0.0 and r["preset"] == "geared"]
    rows = {(r["law"], r["motion"]): r for r in nominal if not r["scarce_torque"]}
    assert page["base_m_s2"] == pytest.approx(1.940, rel=0.01)  # seed 002, section 6
    assert rows["ideal servo", "ZV"]["db"] < -53.0 and rows["ideal servo", "ZVD"]["db"] < -69.0
    assert rows["mpc", WORST]["db"] < -31.0 < rows["lqr", WORST]["db"] < rows["pd", WORST]["db"]
    assert all(r["stopped"] == "" for r in page["rows"])
    missed = {check["name"] for check in page["checks"] if not check["passed"]}
    assert not missed
    assert "<svg" in (tmp_path / "c.html").read_text(encoding="utf-8")
