"""``flexarm bench``: what falls short of its bound fails, and what could not be measured is told."""

from __future__ import annotations

import argparse
import importlib.util
from pathlib import Path

import pytest

from flexarm_bringup.bench import AFTER, BEFORE, BOUNDS, FLOORS, SAME_ARM, add_arguments, build_page
from flexarm_bringup.processes.machine_speed import CLASS_US, filterpy_step_us

ROOT = Path(__file__).parents[3]
BENCHMARKS = ROOT / "benchmarks"
INSTALLED = importlib.util.find_spec("sys")


def without(monkeypatch: pytest.MonkeyPatch, *absent: str) -> None:
    """Let every package be installed but some."""
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None if name in absent else INSTALLED)


@pytest.mark.parametrize(
    ("benchmark", "ratio", "least"),
    [
        ("estimator", "ratio_finite_difference_to_step", 200.0),
        ("engines", "ours_times_exudyn", 50.0),
        ("mpc", "8_states_fastest_sparse_to_mpc_median", 10.0),
        ("mpc", "26_states_do_mpc_to_mpc_median", 200.0),
    ],
)
def test_a_ratio_below_its_floor_is_missed(benchmark: str, ratio: str, least: float) -> None:
    for value, is_kept in ((0.99 * least, False), (least, True)):
        (check,) = build_page({benchmark: {ratio: value}}).checks
        assert check.passed == is_kept
        assert f"at least {least:g}" in check.wanted


def test_a_time_above_its_bound_is_missed() -> None:
    for value, is_kept in ((250.0, True), (251.0, False)):
        (check,) = build_page({"memory": {"memory_largest_mb": value}}).checks
        assert check.passed == is_kept


@pytest.mark.parametrize(
    ("before", "after", "slow"),
    [(2.0, 3.0, 2.0), (3.0, 1.5, 1.5), (0.5, 4.0, 1.0), (1.0, 1.0, 1.0)],
)
def test_times_are_judged_at_the_speed_that_their_bounds_mean(
    before: float, after: float, slow: float
) -> None:
    """The faster of the two counts; a machine that is faster than the class is not asked for more."""
    machine = {BEFORE: before * CLASS_US, AFTER: after * CLASS_US}
    for share, is_kept in ((0.99, True), (1.01, False)):
        found = {"8_states_mpc_median_us": share * slow * 80.0, **machine}
        page = build_page({"mpc": found})
        (check,) = page.checks
        assert check.passed == is_kept
        assert ("times are judged over" in page.to_text()) == (slow > 1.0)
        assert f"{share * slow * 80.0:.4g}" in check.found and f"{share * 80.0:.4g}" in check.found


@pytest.mark.parametrize("key", SAME_ARM)
def test_an_estimator_is_judged_beside_filterpy_on_the_same_arm(key: str) -> None:
    """The machine's speed changes within a benchmark: before and after it are other times."""
    baseline, usual = SAME_ARM[key]
    machine = {BEFORE: 9.0 * CLASS_US, AFTER: 9.0 * CLASS_US}
    for slow, judged in ((3.0, 3.0), (1.0, 1.0), (0.5, 1.0)):
        for share, is_kept in ((0.99, True), (1.01, False)):
            found = {baseline: slow * usual, key: share * judged * BOUNDS[key], **machine}
            (check,) = build_page({"estimator": found}).checks
            assert check.passed == is_kept


@pytest.mark.parametrize(
    ("name", "benchmark"), [("memory_largest_mb", "memory"), ("default_worst_error", "solvers")]
)
def test_what_is_no_time_is_judged_as_it_is(name: str, benchmark: str) -> None:
    machine = {BEFORE: 9.0 * CLASS_US, AFTER: 9.0 * CLASS_US}
    (check,) = build_page({benchmark: {name: 1.01 * BOUNDS[name], **machine}}).checks
    assert not check.passed


def test_a_ratio_is_not_eased_by_a_slow_machine() -> None:
    machine = {BEFORE: 9.0 * CLASS_US, AFTER: 9.0 * CLASS_US}
    (check,) = build_page({"estimator": {"ratio_finite_difference_to_step": 199.0, **machine}}).checks
    assert not check.passed


def test_the_yardstick_is_a_time() -> None:
    assert 1.0 < filterpy_step_us() < 1e5


def test_a_missing_competitor_is_told_in_the_table(monkeypatch: pytest.MonkeyPatch) -> None:
    without(monkeypatch, "exudyn", "piqp", "do_mpc")
    page = build_page({"engines": {"seconds_per_s_ours_2_modes": 60.0}, "mpc": {"8_states_mpc_p99_us": 90.0}})
    text = page.to_text()
    assert "not compared with: exudyn (" in text and "not compared with: piqp, do_mpc (" in text
    engines, mpc = page.items
    assert ["ours_times_exudyn", "not measured (at least 50)"] in list(engines.rows)  # type: ignore[union-attr]
    assert sum("not measured" in str(row[1]) for row in mpc.rows) == len(FLOORS["mpc"])  # type: ignore[union-attr]
    assert [check.name for check in page.checks] == ["mpc: 8_states_mpc_p99_us"]


def test_nothing_is_said_of_competitors_when_all_were_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    without(monkeypatch)
    text = build_page({name: dict(floors) for name, floors in FLOORS.items()}).to_text()
    assert "not" not in text


@pytest.mark.parametrize(
    ("row", "wanted", "names"),
    [
        ("estimator step, single link", "(60 us wanted)", ["single_link_estimator_median_us"]),
        ("the same, two-link arm", "(100 us wanted)", ["two_link_estimator_median_us"]),
        ("the same, 6R, 39 states", "(250 us wanted)", ["serial_6r_estimator_median_us"]),
        ("MPC step, 8 states", "(80 / 250 us wanted)", ["8_states_mpc_median_us", "8_states_mpc_p99_us"]),
        (
            "the same, 18 states, 3 inputs",
            "(200 / 900 us)",
            ["18_states_mpc_median_us", "18_states_mpc_p99_us"],
        ),
        ("the same, 6R, 26 states", "(800 / 2000 us)", ["26_states_mpc_median_us", "26_states_mpc_p99_us"]),
        ("nonlinear MPC step", "(400 / 700 us)", ["nmpc_step_median_us", "nmpc_step_p99_us"]),
    ],
)
def test_what_the_manual_says_is_wanted_is_what_decides(row: str, wanted: str, names: list[str]) -> None:
    page = (ROOT / "docs" / "measured.md").read_text(encoding="utf8")
    (line,) = [line for line in page.splitlines() if f"| {row}" in line]
    assert wanted in line
    assert [float(word) for word in wanted.strip("()").split() if word.isdigit()] == [
        BOUNDS[name] for name in names
    ]
    stems = {name.replace("_median_us", "").replace("_p99_us", "") for name in names}
    assert {key for key in BOUNDS if key.rpartition("_")[0].rpartition("_")[0] in stems} == set(names)


def test_the_help_tells_every_bound() -> None:
    parser = argparse.ArgumentParser()
    add_arguments(parser)
    told = " ".join(parser.format_help().split())
    for name, value in BOUNDS.items():
        assert f"{name} at most {value:g}" in told
    for floors in FLOORS.values():
        assert all(f"{name} at least {value:g}" in told for name, value in floors.items())


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("estimator", ['"ratio_finite_difference_to_step"']),
        ("engines", ['f"ours_times_{engine}"', '("exudyn", "mujoco")']),
        ("mpc", ['"8_states"', '"18_states"', '"fastest_sparse_to_mpc_median"', '"do_mpc_to_mpc_median"']),
    ],
)
def test_the_names_of_the_floors_are_made_by_the_benchmarks(name: str, parts: list[str]) -> None:
    source = (BENCHMARKS / f"bench_{name}.py").read_text(encoding="utf-8")
    assert name in FLOORS
    assert [part for part in parts if part not in source] == []  # else a floor would never be checked
