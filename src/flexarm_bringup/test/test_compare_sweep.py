"""``flexarm compare``: references of least torque, what a sweep tells, and when a tip sets out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flexarm_bringup.compare_laws.judged import CompareResult, LegFigures, TrueRecord, judge_leg
from flexarm_bringup.compare_laws.least_torque import least_torque
from flexarm_bringup.compare_laws.legs import ComparedLeg, compared_legs
from flexarm_bringup.compare_laws.open_loop_motions import LegMotions
from flexarm_bringup.compare_laws.schemes import MPC, WORST, Case
from flexarm_bringup.compare_laws.sweep import LEAST_TORQUE, SWEEP_ERRORS, Sweep, plan_sweep
from flexarm_bringup.compare_laws.sweep_page import STOPPED, sweep_rows, sweep_tables
from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.course import Leg
from flexarm_bringup.tasks.task import Task
from flexarm_bringup.tasks.task_for import task_for
from flexarm_controller.open_loop.rest_to_rest import RestToRest, fastest
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.tree.reduced_tree import ReducedTree

ARM = Path(__file__).resolve().parents[3] / "docs" / "two_link.yaml"
MOVES = f"""
format: flexarm-moves/1
manipulator: {ARM}
wait: 2.5 s
watch: {{from: 100 ms, to: 2.1 s, below: 50 Hz, tolerance: 0.5 mm}}
moves: {{there: {{to: stretched, duration: 230 ms, ramps: [10 ms, 10 ms]}}}}
"""


@pytest.fixture(scope="module")
def task(tmp_path_factory: pytest.TempPathFactory) -> Task:
    path = tmp_path_factory.mktemp("fast") / "fast.yaml"
    path.write_text(MOVES)
    return task_for(str(path))


@pytest.fixture(scope="module")
def leg(task: Task) -> ComparedLeg:
    tree = ReducedTree(load_config(find_manipulator(task.manipulator)), use_compiler=False)
    return compared_legs(tree, task, StaticArm(tree).start(task.start))[0]


@pytest.fixture(scope="module")
def case(task: Task, leg: ComparedLeg) -> Case:
    optimum = fastest(RestToRest(leg.middle, leg.limits, leg.start, leg.goal, leg.dt), 46)
    return Case(task, (leg,), {leg.name: LegMotions({WORST: leg.given}, {}, optimum)})


def test_a_reference_of_least_torque_keeps_the_velocity_between_its_periods_too(
    case: Case, leg: ComparedLeg
) -> None:
    """It was refused wherever the velocity binds: up to 0.8 % too fast between two periods."""
    for periods in (43, 50, 60):
        motion = least_torque(leg, periods)
        reference = case.scheme(MPC, LEAST_TORQUE, {leg.name: motion}).reference
        assert reference.fault(leg.limits) == ""
        assert motion.duration == pytest.approx(periods * leg.dt)
        assert abs(motion.theta_dot[:, 1]).max() > 0.94 * leg.limits.velocity[1]  # not slower than needed
    with pytest.raises(ValueError, match=r"no motion of 0\.1 s within the limits"):
        least_torque(leg, 20)


def test_all_that_a_sweep_runs_on_least_torque_can_be_followed(
    case: Case, leg: ComparedLeg, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("flexarm_bringup.compare_laws.sweep.FACTORS", (0.8, 1.0, 1.2))
    planned = plan_sweep(case)
    least = [point for point in planned.points if point.kind == LEAST_TORQUE]
    assert least and all(point.is_within for point in least)
    assert all(point.scheme.reference.fault(leg.limits) == "" for point in least)
    assert len(least) + len(planned.left_out) == 2  # none below the time-optimal duration


def row(motion: str, error: float, stopped: str, moving: float | None) -> CompareResult:
    legs = () if stopped else (LegFigures(0.1, 0.1, moving, 0.0, 0.5, 1e-4),)
    return CompareResult("", error, motion, MPC, False, legs, stopped, np.zeros(1), np.zeros(1))


def test_a_run_of_a_sweep_without_a_time_says_why_everywhere(
    case: Case, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It said "never", as of an arm that does not settle; JSON did not have it, and no bound was missed."""
    monkeypatch.setattr("flexarm_bringup.compare_laws.sweep.FACTORS", (1.2,))
    first, second = plan_sweep(case).points
    points, why = (first, second), "gauge 1 is strained beyond its limit"
    names = [point.scheme.motion for point in points]
    results = [
        row(name, error, why if i or error < 0.0 else "", 0.5)
        for error in SWEEP_ERRORS
        for i, name in enumerate(names)
    ]
    sweep = Sweep(points, {"least torque (LP), 0.210 s": "no motion of 0.21 s"})
    (table,), (check,) = sweep_tables(case, (sweep, results))
    assert table.rows[1][2:] == [None] * 6 and None not in table.rows[0][:6] and table.rows[0][6] is None
    assert table.notes[1:] == [
        "left out: least torque (LP), 0.210 s: no motion of 0.21 s",
        f"{names[1]}: {why}",
        f"{names[0]}, f -10 %: {why}",
    ]
    assert (check.name, check.found, check.passed) == (STOPPED, "3", False)  # of the second kind alone
    plain = sweep_rows((sweep, results), 1.0)
    assert len(plain) == 6 and plain[1]["stopped"] == why and plain[1]["takes_s"] is None
    assert plain[0]["takes_s"] == pytest.approx(first.duration + 0.1 if first.duration > 0.4 else 0.5)


def test_a_tip_that_wobbles_before_its_move_sets_out_with_the_move() -> None:
    """The first tick outside the ball counted: a quarter of a second too early, of a filter that begins."""
    task = task_for("single_link")
    t = np.arange(0.0, 4.0, 0.005)
    wobble = np.where(t < 0.4, 1e-3, 0.0)  # twice the ball, when the slot of the move begins
    along = np.clip((t - 0.5) / 1.0, 0.0, 1.0) * 0.1
    tip, none = np.stack([along, wobble, 0 * t], axis=1), np.zeros((t.size, 1))
    goal = np.array([0.1, 0.0, 0.0])
    figures = judge_leg(TrueRecord(t, tip, none, none, none), Leg("out", 0.5, 1.5), task, np.zeros(3), goal)
    assert figures.moving == pytest.approx(1.0, abs=0.02)
    tip[:, 1] = np.where(t < 0.7, 1e-3, 0.0)  # and not in the ball at all before
    figures = judge_leg(TrueRecord(t, tip, none, none, none), Leg("out", 0.5, 1.5), task, np.zeros(3), goal)
    assert figures.moving is None
    swing = np.where(t < 0.7, 2e-3 * np.cos(2 * np.pi * 5.0 * t), 0.0)  # through the ball, 16 ms each time
    tip[:, 1] = swing
    figures = judge_leg(TrueRecord(t, tip, none, none, none), Leg("out", 0.5, 1.5), task, np.zeros(3), goal)
    assert figures.moving is None
    tip[:, 1] = np.where(t > 0.3, swing, 0.0)  # a law that winds up has set out
    figures = judge_leg(TrueRecord(t, tip, none, none, none), Leg("out", 0.5, 1.5), task, np.zeros(3), goal)
    assert figures.moving == pytest.approx(1.2, abs=0.02)
    lap = np.stack([0.1 * np.sin(np.pi * np.clip(t - 0.5, 0.0, 1.0)), 0 * t, 0 * t], axis=1)
    start = np.zeros(3)
    figures = judge_leg(TrueRecord(t, lap, none, none, none), Leg("lap", 0.5, 1.5), task, start, start)
    assert figures.moving == pytest.approx(1.0, abs=0.02)


def test_a_row_without_the_time_of_one_move_has_none() -> None:
    known = row("a", 0.0, "", 0.5)
    both = replace(known, legs=(*known.legs, replace(known.legs[0], moving=None)))
    assert (known.moving, both.moving) == (0.5, None)
