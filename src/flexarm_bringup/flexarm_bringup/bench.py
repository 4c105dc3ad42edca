"""Measure the time of every step: model, estimator, controller, simulation, memory of the nodes.

CPU time of one thread, medians and 99th percentiles, each beside its baseline in the same run, so that the
ratios hold on a busy machine too. Bounds of time are those of a class of machine: where plain filterpy takes
longer than there, what is judged is the time that was found over that ratio, and both are told. For the
estimator that is filterpy on the same arm, else a step of it before and after the benchmark. The benchmarks
themselves are in benchmarks/, one file each.

  flexarm bench                 everything
  flexarm bench mpc estimator   some of them

What must be kept is listed below and in the table 'Acceptance'. Of the estimator these are medians. Its 99th
percentiles are told beside them and judge nothing: 100 us had been wanted of the single link, 0.31 to 0.37 ms
are what docs/measured.md has, and more comes of a busy machine.
"""

from __future__ import annotations

import argparse
import importlib.util
import os
import sys
from pathlib import Path
from types import ModuleType

from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cell, Column, Page, Table, add_report_arguments, publish
from flexarm_bringup.processes.machine_speed import CLASS_US, filterpy_step_us, in_words, slowness
from flexarm_bringup.progress import Progress

FOLDER = "benchmarks"
PREFIX = "bench_"
BOUNDS = {  # name of a result: largest value allowed
    "single_link_estimator_median_us": 60.0,
    "two_link_estimator_median_us": 100.0,
    "serial_6r_estimator_median_us": 250.0,
    "8_states_mpc_median_us": 80.0,
    "8_states_mpc_p99_us": 250.0,
    "18_states_mpc_median_us": 200.0,
    "18_states_mpc_p99_us": 900.0,
    "26_states_mpc_median_us": 800.0,
    "26_states_mpc_p99_us": 2000.0,
    "default_worst_error": 1e-3,
    "default_p99_over_best_exact": 1.05,  # noise of one that is the best
    "nmpc_step_median_us": 400.0,
    "nmpc_step_p99_us": 700.0,
    "memory_largest_mb": 250.0,
    "identify_60_s_of_8_channels_s": 10.0,
    "serial_6r_new_median_us": 5000.0,
    **{
        f"{name}_new_median_us": 2000.0
        for name in ("single_link", "planar_3rrr", "spatial_3tpt", "variable_stiffness")
    },
}

FLOORS: dict[str, dict[str, float]] = {  # benchmark: name of a result: smallest value allowed
    "mpc": {
        f"{size}_states_{other}_to_mpc_median": ratio
        for size in (8, 18, 26)
        for other, ratio in (("fastest_sparse", 10.0), ("do_mpc", 200.0))
    },
    "estimator": {"ratio_finite_difference_to_step": 200.0},
    "engines": {"ours_times_exudyn": 50.0},
}
COMPETITORS = {  # benchmark: packages that it compares with; each is left out where it is not installed
    "mpc": ("osqp", "piqp", "clarabel", "do_mpc"),
    "engines": ("exudyn", "mujoco"),
}
REMARKS = {  # benchmark: how to read what is judged
    "estimator": ("p99: 99th percentiles; they are told, medians are judged",),
    "solvers": ("the default is to be exact on all machines, and of those that are to have the lowest p99",),
}
NOT_MEASURED = "not measured"
BEFORE, AFTER = "filterpy_step_before_us", "filterpy_step_after_us"  # the machine's own speed
TIMES = ("_us", "_s")  # endings of what a slow machine makes longer
SAME_ARM = {  # time: that of plain filterpy for the same arm, and what it takes on the class of machine [us]
    "single_link_estimator_median_us": ("single_link_filterpy_median_us", 19.0),
    "two_link_estimator_median_us": ("two_link_filterpy_median_us", 27.0),
    "serial_6r_estimator_median_us": ("serial_6r_filterpy_median_us", 37.0),
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the choice of benchmarks and the report files."""
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help=f"which benchmarks (default: all in {FOLDER}/)"
    )
    parser.add_argument(
        "--folder", type=Path, default=None, help=f"where they are (default: {FOLDER}/ of the source tree)"
    )
    add_report_arguments(parser)
    parser.epilog = "\n  ".join(
        ["Exit code 1 when a bound was missed, of those that were measured:", *spoken_bounds()]
    )


def spoken_bounds() -> list[str]:
    """Return every bound in words."""
    least = [(name, value) for floors in FLOORS.values() for name, value in floors.items()]
    return [
        *(f"{name} at most {value:g}" for name, value in BOUNDS.items()),
        *(f"{name} at least {value:g}" for name, value in least),
    ]


def run(args: argparse.Namespace) -> int:
    """Run the benchmarks and print their results; returns the exit code."""
    folder = args.folder or Path(os.environ.get("FLEXARM_SOURCE", ".")) / FOLDER
    files = {path.stem.removeprefix(PREFIX): path for path in sorted(folder.glob(f"{PREFIX}*.py"))}
    unknown = [name for name in args.names if name not in files]
    if unknown or not files:
        print(
            f"flexarm bench: no benchmark {', '.join(unknown) or 'at all'} in {folder}; "
            f"there are: {', '.join(files) or 'none'}",
            file=sys.stderr,
        )
        return UNUSABLE
    progress, results = Progress(), {}
    for name in args.names or files:
        progress.say(f"benchmark {name}")
        before = filterpy_step_us()
        found = load_module(files[name]).main()
        results[name] = {**found, BEFORE: before, AFTER: filterpy_step_us()}
    progress.done()
    return publish(build_page(results), args)


def load_module(path: Path) -> ModuleType:
    """Import a benchmark from its file."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


def build_page(results: dict[str, dict[str, float]]) -> Page:
    """Return the page of all results."""
    lead = "CPU time of one thread; _us are microseconds, ratios are to the baseline named."
    tables = [_table(name, values) for name, values in results.items()]
    checks = [check for name, values in results.items() for check in _checks(name, values)]
    return Page("flexarm: how long it takes", lead, tables, checks)


def _table(name: str, values: dict[str, float]) -> Table:
    """Return what a benchmark measured, what it should have but did not, and who was not there."""
    rows: list[list[Cell]] = [[key, float(value)] for key, value in values.items()]
    floors = FLOORS.get(name, {})
    rows += [[key, f"{NOT_MEASURED} (at least {floors[key]:g})"] for key in floors if key not in values]
    told = [*REMARKS.get(name, ()), *_speed(values)]
    absent = [who for who in COMPETITORS.get(name, ()) if importlib.util.find_spec(who) is None]
    notes = [f"not installed, so not compared with: {', '.join(absent)} (requirements.bench.lock)"]
    columns = [Column("figure"), Column("value", ".4g")]
    return Table(name, columns, rows, (*told, *(notes if absent else ())))


def _slowness(values: dict[str, float], key: str = "") -> float:
    """Return how many times as long this machine took as the class that the bounds are of."""
    if key in SAME_ARM and SAME_ARM[key][0] in values:
        baseline, usual = SAME_ARM[key]
        return max(values[baseline] / usual, 1.0)
    if key and not key.endswith(TIMES):
        return 1.0
    steps = [values[key] for key in (BEFORE, AFTER) if key in values]
    return slowness(*(steps or [CLASS_US]))


def _speed(values: dict[str, float]) -> list[str]:
    """Return in words what is judged where the machine is slower than the bounds mean."""
    slow = _slowness(values)
    told = [] if slow == 1.0 else [f"{in_words(slow)}: times are judged over that"]
    if any(key in values and _slowness(values, key) > 1.0 for key in SAME_ARM):
        usual = ", ".join(f"{usual:g}" for _, usual in SAME_ARM.values())
        told.append(f"estimators: over what filterpy takes for the same arm, in us over {usual}")
    return told


def _checks(name: str, values: dict[str, float]) -> list[Check]:
    """Return the bounds of a benchmark, of what it measured."""
    checks = []
    for key, value in values.items():
        slow = _slowness(values, key)
        told = f"{value:.4g}" if slow == 1.0 else f"{value:.4g}; over {slow:.2f}: {value / slow:.4g}"
        for bounds, word, sign in ((BOUNDS, "at most", 1.0), (FLOORS.get(name, {}), "at least", -1.0)):
            if key in bounds:
                is_kept = sign * value / slow <= sign * bounds[key]
                checks.append(Check(f"{name}: {key}", f"{word} {bounds[key]:g}", told, is_kept))
    return checks
