"""``flexarm demo NAME`` without its nodes: the reference's file, the nodes' parameters, the table."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("domain_coordinator", reason="needs ROS")

from flexarm_bringup.demo_run import nodes_runs, task_command
from flexarm_bringup.demo_run.task_report import build_page
from flexarm_bringup.demo_run.task_session import TaskRun, task_settings, torque_difference
from flexarm_bringup.demo_run.timekeeping import Timekeeping
from flexarm_bringup.demo_run.unfinished import unfinished
from flexarm_bringup.loop_effort import Effort
from flexarm_bringup.page.report import Table
from flexarm_bringup.processes.session import Session, SessionError
from flexarm_bringup.progress import Progress
from flexarm_bringup.sim_run.conditions import NOMINAL
from flexarm_bringup.sim_run.study import LegResult, SimJob, SimResult, Trace
from flexarm_bringup.tasks.course import Course, Leg
from flexarm_bringup.tasks.reference_file import from_rest, load_reference, save_reference
from flexarm_bringup.tasks.task import find_task, load_task
from flexarm_bringup.tip_vibration import Residual
from flexarm_controller.reference import Reference
from flexarm_controller.settings import ControllerConfig
from flexarm_model.manipulator.start_pose import starting_at
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.overrides import apply_overrides
from flexarm_model.settings.strict_yaml import ConfigError

LEG = Leg("lateral", 0.3, 0.5)
LEFT = {"pd": 0.8, "mpc": 0.1}  # m/s^2


def motion() -> Reference:
    t = np.array([0.5, 0.6, 0.8])
    theta = np.array([[0.1, 1.0], [0.2, 0.9], [0.3, 0.7]])
    return Reference(t, theta, np.zeros((3, 2)), np.ones((3, 2)))


def leg(law: str) -> LegResult:
    return LegResult(LEG, Residual(LEFT[law], 1e-3, 0.1, 0.2), 1e-3, 0.5)


def in_process(law: str) -> SimResult:
    trace = Trace(np.arange(3.0), np.zeros((3, 3)), np.full((3, 1), 0.25))
    effort = Effort(speed=4.0, served=4, adopt_time=0.0, unusable=0.0, guard="")
    return SimResult("sim", NOMINAL, law, legs=(leg(law),), effort=effort, trace=trace)


def over_dds(law: str, lockstep: bool, missed: int, off: float = 0.0) -> TaskRun:
    session = Session(Path("folder"), "sim", lockstep, (), "", "", manipulator="spatial_3tpt")
    trace = Trace(np.arange(2.0), np.zeros((2, 3)), np.full((2, 1), 0.25 + off))
    guard: dict[str, Any] = {"ticks": 1000, "ticks_without_command": missed, "told": []}
    return TaskRun(session, "sim", law, (leg(law),), trace, guard)


def test_a_reference_comes_back_from_its_file_bit_for_bit(tmp_path: Path) -> None:
    save_reference(tmp_path / "reference.npz", motion(), 3.5)
    read, end = load_reference(tmp_path / "reference.npz")
    assert end == 3.5
    assert all(np.array_equal(getattr(read, part), getattr(motion(), part)) for part in ("t", "theta"))


def test_a_file_that_is_no_reference_is_refused_by_name(tmp_path: Path) -> None:
    (tmp_path / "reference.npz").write_text("nothing")
    with pytest.raises(ConfigError, match=r"reference\.npz"):
        load_reference(tmp_path / "reference.npz")


def test_rest_before_a_motion_is_written_out_and_changes_nothing() -> None:
    whole = from_rest(motion())
    assert whole.t[0] == 0.0
    times = np.linspace(0.0, 1.0, 41)
    for ours, given in zip(whole.sample(times)[:2], motion().sample(times)[:2], strict=True):
        assert np.array_equal(ours, given)


def test_an_arm_that_starts_elsewhere_is_the_same_arm() -> None:
    config = load_config(find_manipulator("single_link"), "geared")
    elsewhere = starting_at(config, (0.3,))
    assert (elsewhere.home.tolist(), elsewhere.config_id) == ([0.3], config.config_id)
    assert starting_at(config, ()) is config
    with pytest.raises(ConfigError, match=r"start: 2 values; expected one each for base\.rz"):
        starting_at(config, (0.1, 0.2))


def test_nodes_get_the_settings_of_the_task_and_the_period_of_the_machine() -> None:
    task = load_task(find_task("spatial_3tpt"))
    still = np.zeros((1, 3))
    course = Course(np.array([0.4, 0.5, 0.6]), motion(), (LEG,), 1.0, np.zeros(1), still)
    settings = task_settings(SimJob(task, "sim", NOMINAL, course), "pd")
    controller = apply_overrides(ControllerConfig, settings["controller"])
    assert (controller.law, controller.period) == ("pd", 0.001)
    assert settings["model"]["start"] == settings["rig"]["start"] == (0.4, 0.5, 0.6)
    assert settings["model"]["length"] == task.settings["schedule"]["length"]


def test_the_table_says_what_was_missed_and_that_a_fast_machine_has_no_real_time() -> None:
    task = load_task(find_task("spatial_3tpt"))
    configs = {"sim": load_config(find_manipulator("spatial_3tpt"), "sim")}
    results = [in_process(law) for law in LEFT]
    runs = [over_dds(law, True, 0) for law in LEFT]
    page = build_page(task, configs, results, runs, ())
    [table] = page.items
    assert isinstance(table, Table)
    assert [row[1] for row in table.rows] == ["in process"] * 2 + ["DDS lockstep"] * 2
    assert any("1000 Hz: in lockstep only" in note for note in table.notes)
    assert all(check.passed for check in page.checks), page.checks
    live = build_page(
        task, configs, results, [*runs, over_dds("pd", False, 0), over_dds("mpc", False, 20)], ()
    )
    failed = [check for check in live.checks if not check.passed]
    assert [check.found for check in failed] == ["2 %"]


def test_a_run_in_real_time_that_could_not_be_kept_is_a_missed_bound_and_not_a_row() -> None:
    task = load_task(find_task("spatial_3tpt"))
    configs = {"sim": load_config(find_manipulator("spatial_3tpt"), "sim")}
    runs = [over_dds(law, True, 0) for law in LEFT] + [over_dds("pd", False, 0)]
    missing = unfinished("mpc_real_time", "guard stopped the arm: no command for 50 ms", Timekeeping())
    page = build_page(task, configs, [in_process(law) for law in LEFT], runs, (), [missing])
    [table] = page.items
    assert isinstance(table, Table)
    assert "DDS real time" not in [row[1] for row in table.rows]
    assert [check for check in page.checks if not check.passed] == [missing]


def test_what_was_missed_by_the_clock_is_no_verdict_where_the_machine_itself_stood_still() -> None:
    """Of one law's run alone, and of the gain, for which both are needed; lockstep has no clock."""
    task = load_task(find_task("spatial_3tpt"))
    configs = {"sim": load_config(find_manipulator("spatial_3tpt"), "sim")}
    kept = Timekeeping(excuse="the machine stood still")
    slow = replace(over_dds("mpc", False, 20), kept=kept, legs=(leg("pd"),))
    page = build_page(
        task, configs, [in_process(law) for law in LEFT],
        [over_dds("pd", True, 0), over_dds("mpc", True, 0, 0.1), over_dds("pd", False, 30), slow], (),
        [unfinished("another", "stopped", Timekeeping()),
         unfinished("one more", "stopped", Timekeeping(slow=2.0))],
    )  # fmt: skip
    verdicts = {check.name: check.verdict for check in page.checks if not check.passed}
    assert verdicts == {
        "DDS real time: MPC below joint PD, all moves": "not judged",
        "sim PD: motor periods without a fresh command": "MISSED",
        "sim MPC: torque in lockstep from in-process": "MISSED",
        "sim MPC: real time from in-process, all moves": "not judged",
        "sim MPC: motor periods without a fresh command": "not judged",
        "another": "MISSED",
        "one more": "not judged",
    }


def test_lockstep_that_differs_from_one_process_is_told() -> None:
    assert torque_difference(over_dds("mpc", True, 0), in_process("mpc")) == 0.0
    assert torque_difference(over_dds("mpc", True, 0, 1e-3), in_process("mpc")) == pytest.approx(1e-3)


def test_a_law_that_the_guard_refuses_does_not_hide_what_the_others_were_worth(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def run(job: SimJob, result: SimResult, lockstep: bool, *_: object) -> TaskRun:
        """Return a run; SessionError under joint PD."""
        if result.law == "pd":
            raise SessionError("guard refused to arm")
        return over_dds(result.law, lockstep, 0)

    monkeypatch.setattr(task_command, "run_task_session", run)
    monkeypatch.setattr(nodes_runs, "run_parallel", lambda do, todo, _: [x for job in todo for x in do(job)])
    task = load_task(find_task("spatial_3tpt"))
    results = [in_process("pd"), in_process("mpc")]
    course = Course(np.zeros(3), motion(), (LEG,), 1.0, np.zeros(1), np.zeros((1, 3)))
    jobs = [SimJob(task, "sim", NOMINAL, course)]
    args = argparse.Namespace(folder=tmp_path, no_realtime=True)
    runs, failures = task_command._run_sessions(args, task, jobs, results, Progress())
    assert [run.law for run in runs] == ["mpc"]
    (failure,) = failures
    assert (failure.name, failure.found, failure.verdict) == (
        "sim_pd_lockstep", "guard refused to arm", "MISSED",
    )  # fmt: skip
