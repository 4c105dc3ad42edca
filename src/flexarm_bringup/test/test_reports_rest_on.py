"""Every command that reports on an arm tells what its figures rest on; each runs without what takes long."""

from __future__ import annotations

import importlib
import json
from collections.abc import Callable
from html import unescape
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flexarm_bringup.bags.bag_reader import check_bag
from flexarm_bringup.bags.configuration import configuration
from flexarm_bringup.cli import COMMANDS, main
from flexarm_bringup.drift_run.simulation import Watched
from flexarm_bringup.identify.updated_page import Updated
from flexarm_bringup.page.figures import Figure
from flexarm_bringup.page.report import Page
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

SINGLE = load_config(find_manipulator("single_link"))
BAG = Path(__file__).parents[3] / "tests" / "golden" / "single_link" / "bag"
OF_NO_ARM = {
    "rig": "no report", "echo": "no report", "call": "no report", "arm": "no report", "stop": "no report",
    "goto": "no report", "monitor": "no report", "parameters": "of nodes", "security": "of nodes",
    "doctor": "of a computer", "bench": "of a computer", "recover": "of a file", "regress": "equal or not",
}  # fmt: skip
IN_THEIR_OWN_TESTS = {"reproduce"}  # test_reproduce_000 to _004: "Assumed" and "Fitted" of each paper


def nothing(*_: Any, **__: Any) -> Page:
    """Stand for what makes a page."""
    return Page("Title", "Lead.", remarks={"read it so": ["plainly"]})


def none_of(*_: Any, **__: Any) -> list[Any]:
    """Stand for what takes long and returns a list."""
    return []


def these(**values: Any) -> Callable[..., Any]:
    """Stand for what takes long and returns something with attributes."""
    return lambda *_, **__: SimpleNamespace(**values)


def watched(*_: Any, **__: Any) -> Watched:
    """Stand for the drift watch."""
    return Watched(np.zeros(0), (), (), "", "")


SIMULATED = {"sim_jobs": none_of, "run_sim_jobs": none_of, "build_page": nothing}
SINGLE_LEG = SimpleNamespace(goal=np.zeros(1))
IDENTIFIED = {
    "read_sources": these(responses=SimpleNamespace(outputs=()), estimator="H1", set_ups=()),
    "identify": none_of, "judge_halves": none_of, "build_page": nothing, "with_halves": nothing,
}  # fmt: skip
# the command line of every report, and what stands for what, by the name in the command's module
REPORTS: list[tuple[str, dict[str, Any]]] = [
    ("model single_link", {}),
    ("model single_link --grid 2", {}),
    ("sim single_link", SIMULATED),
    ("demo --no-dds --folder DIR", {"run_jobs": none_of, "draw_tip": lambda _: Figure("", ""),
                                    "draw": lambda *_: [], "build_page": nothing}),
    ("demo single_link --no-dds --folder DIR", {"run_task_demo.draw": none_of}
     | {f"run_task_demo.{name}": stub for name, stub in SIMULATED.items()}),
    ("compare single_link", {"_plan": lambda *_: (None, {"geared": SimpleNamespace(legs=[SINGLE_LEG])}),
                             "_jobs": none_of, "run_compare_jobs": none_of, "floors_at_rest": none_of,
                             "build_page": nothing}),
    ("faults single_link --rows 1", {"run_drill": none_of}),
    ("margins single_link", {"run_study": none_of, "build_page": nothing}),
    ("consistency single_link", {"run_parallel": none_of}),
    ("replay BAG", {"replay": none_of, "page": nothing}),
    ("replay BAG --remap /a:=joint_states", {"feed_bag": these(statuses={}, ignored={}),
                                             "_foreign_tables": none_of}),
    ("plot BAG --html DIR/p.html", {"draw_each": lambda *_: ([], {})}),
    ("ablate BAG", {"run_parallel": none_of, "judge_tracks": none_of, "build_page": nothing}),
    ("smooth BAG", {"run_estimator": none_of, "track_of": these(stamps_ns=[0]), "run_smoother": none_of,
                    "judged_with": none_of, "build_page": nothing}),
    ("tune BAG", {"Tuner": these(tune=these(noise=None)), "judge": none_of, "refuse_unlikely": nothing,
                  "build_page": nothing}),
    ("drift BAG", {"watch_bag": watched}),
    ("drift --simulate single_link --change 0", {"run_drill": watched}),
    ("identify x.npz --manipulator single_link", IDENTIFIED),
    ("identify x.npz --manipulator single_link --output-only",
     {"read_records": none_of, "output_only_page": nothing}),
    ("identify x.npz --manipulator single_link --joints", {"joints_page": nothing}),
    ("realtime", {"measure": none_of, "build_page": nothing}),
    ("soak", {"os": SimpleNamespace(environ={})}),
]  # fmt: skip


def page_of(line: str, stubs: dict[str, Any], patch: pytest.MonkeyPatch, folder: Path) -> Page:
    """Return the page that a command line publishes, with stubs in the module of its command."""
    module: Any = importlib.import_module(COMMANDS[line.split()[0]].module)
    modules = [module]
    for name, stub in stubs.items():
        beside, _, own = name.rpartition(".")
        if beside:  # in the module that a function comes from
            modules.append(importlib.import_module(getattr(module, beside).__module__))
        patch.setattr(modules[-1], own, stub)
    pages: list[Page] = []

    def keep(page: Page, _: Any) -> int:
        pages.append(page)
        return 0

    for each in modules:
        patch.setattr(each, "publish", keep)
    words = line.replace("BAG", str(BAG)).replace("DIR", str(folder)).split()
    assert main(words) == 0
    (page,) = pages
    return page


def lists_of(config: ManipulatorConfig) -> list[str]:
    """Return all that an arm rests on."""
    assert config.assumed and config.fitted
    return [*config.assumed, *config.fitted]


def test_every_command_is_asked_here_or_reports_on_no_arm() -> None:
    """A new command fails here until somebody has said what it reports on."""
    asked = {line.split()[0] for line, _ in REPORTS}
    assert not asked & set(OF_NO_ARM)
    assert asked | set(OF_NO_ARM) | IN_THEIR_OWN_TESTS == set(COMMANDS)


@pytest.mark.parametrize(("line", "stubs"), REPORTS, ids=[line for line, _ in REPORTS])
def test_a_report_on_an_arm_tells_what_it_rests_on(
    line: str, stubs: dict[str, Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """All of both lists, behind every other remark."""
    if line.split()[0] in ("realtime", "soak", "demo"):
        pytest.importorskip("rclpy", reason="imports nodes")
    if line == "soak":
        monkeypatch.setattr("flexarm_bringup.soak.run_node.soak", these(page=nothing))
    page = page_of(line, stubs, monkeypatch, tmp_path)
    assert list(page.remarks)[-2:] == ["assumed", "fitted"]
    arm = configuration(check_bag(BAG))[0] if "BAG" in line else SINGLE
    told = [*page.remarks["assumed"], *page.remarks["fitted"]]
    assert set(lists_of(arm)) <= set(told)


def test_the_lists_are_printed_in_all_three_forms(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("flexarm_bringup.consistency.command.run_parallel", none_of)
    files = {kind: tmp_path / f"page.{kind}" for kind in ("json", "html")}
    main(["consistency", "single_link", "--json", str(files["json"]), "--html", str(files["html"])])
    remarks = json.loads(files["json"].read_text(encoding="utf-8"))["remarks"]
    assert set(lists_of(SINGLE)) <= {*remarks["assumed"], *remarks["fitted"]}
    text, html = capsys.readouterr().out, files["html"].read_text(encoding="utf-8")
    for form in (text, unescape(html)):
        assert all(line in form for line in lists_of(SINGLE))


def test_of_several_arms_each_is_told_under_its_name(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    page = page_of("consistency single_link planar_3rrr", {"run_parallel": none_of}, monkeypatch, tmp_path)
    heads = [f"{head} of {name}" for name in ("single_link", "planar_3rrr") for head in ("assumed", "fitted")]
    assert list(page.remarks) == heads


def test_measurements_that_are_held_against_no_arm_rest_on_none(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    assert list(page_of("identify x.npz", IDENTIFIED, monkeypatch, tmp_path).remarks) == ["read it so"]


def test_a_fitted_description_says_what_was_fitted_just_now(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The lists are of the file that was written: what the report's last figures are of."""
    new = tmp_path / "new.yaml"
    text = find_manipulator("single_link").read_text(encoding="utf-8")
    new.write_text(text.replace("fitted:\n", "fitted:\n  - the mass, just now\n"), encoding="utf-8")
    line = f"identify x.npz --manipulator single_link --fit bodies.strip.damping_ratio --update {new}"
    stub = {"with_update": lambda page, *_: Updated(page, new)}
    page = page_of(line, IDENTIFIED | stub, monkeypatch, tmp_path)
    assert page.remarks["fitted"] == ("the mass, just now", *SINGLE.fitted)
