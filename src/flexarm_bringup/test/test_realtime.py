"""Figures of a run by the clock, and the processes and the description that it starts with."""

from pathlib import Path

import yaml

from flexarm_bringup.realtime.command import to_and_fro, write_manipulator
from flexarm_bringup.realtime.figures import Counts, Figures
from flexarm_bringup.realtime.processes import command_line, processes
from flexarm_model.config import load_config

GOOD = Counts(1000, 0, 9, 998, 9, 2)


def figures(counts=GOOD, stop=""):
    return Figures(5.0, counts, {"mpc": counts.statuses}, [1e-4, 2e-4, 3e-4], stop)


def missed(found):
    return [check.name for check in found.checks() if not check.passed]


def test_counts_are_of_the_time_that_was_watched():
    assert Counts(50, 3, 2, 40, 1, 9).since(Counts(20, 1, 2, 15, 0, 9)) == Counts(30, 2, 0, 25, 1, 0)


def test_just_under_one_percent_is_kept_and_one_percent_is_not():
    assert not missed(figures())
    assert missed(figures(Counts(1000, 0, 10, 998, 9, 2))) == ["ticks without a fresh command"]
    assert missed(figures(Counts(1000, 0, 9, 900, 9, 100))) == ["controller overruns"]


def test_one_late_guard_cycle_is_one_too_many():
    assert missed(figures(Counts(1000, 1, 0, 1000, 0, 0))) == ["guard cycles that began late"]


def test_cycles_that_nobody_told_of_and_a_stop_are_missed_bounds():
    assert missed(figures(Counts(1000, 0, 0, 980, 0, 0))) == ["guard cycles answered or told as missed"]
    assert missed(figures(stop="no command for 50 ms")) == ["the arm was not stopped"]


def test_nothing_counted_is_not_a_success():
    assert missed(figures(Counts()))


def test_another_rate_changes_the_description_in_nothing_else(tmp_path):
    path = write_manipulator(tmp_path, 500.0)
    fast, own = load_config(path, "geared"), load_config(write_manipulator(tmp_path, 0.0), "geared")
    assert (fast.rate_hz, own.rate_hz) == (500.0, 200.0)
    assert fast.config_id != own.config_id
    assert fast.actuated == own.actuated and fast.modes == own.modes


def test_the_reference_fills_the_time_and_comes_back():
    reference = to_and_fro(20.0)
    assert reference.t[-1] > 17.0  # the last move of a slot ends before its wait is over
    assert abs(reference.theta.max() - 0.5236) < 1e-9
    assert abs(reference.theta[-1, 0]) < 1e-9


def test_two_nodes_in_one_process_keep_their_names_and_parameters(tmp_path):
    apart = processes("arm.yaml", "geared", 500.0, False)
    rows = processes("arm.yaml", "geared", 500.0, True)
    assert {row.name for row in apart} - {row.name for row in rows} == {"estimator", "controller"}
    own = next(row for row in rows if row.name == "composed")
    line = command_line(own, tmp_path)
    assert "__node:=" not in " ".join(line) and Path(line[0]).name == "composed_node"
    nodes = yaml.safe_load(Path(line[-1]).read_text(encoding="utf8"))
    for row in apart:
        if row.name in ("estimator", "controller"):
            assert nodes[f"/flexarm/{row.name}"]["ros__parameters"] == dict(row.parameters)
    assert nodes["/flexarm/controller"]["ros__parameters"]["period"] == 0.002
