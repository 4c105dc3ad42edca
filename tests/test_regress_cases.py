"""Cases of the regression: made, judged, renewed and drawn; what cannot be judged says why in one line."""

from __future__ import annotations

import json
import shutil
import sys
import time
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import pytest
import yaml

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
pytest.importorskip("rclpy", reason="needs ROS")

from planted_changes import PLANTED  # noqa: E402

sys.path.insert(0, str(Path(__file__).parents[1] / "src" / "flexarm_bringup" / "test"))
from rosbag2_layout import faults, write_version  # noqa: E402

from flexarm_bringup import cli  # noqa: E402
from flexarm_bringup.bags.bag_copy import copy_bag  # noqa: E402
from flexarm_bringup.bags.bag_reader import check_bag, decode  # noqa: E402
from flexarm_bringup.regress.case import EXPECT_FILE, read_case, write_case  # noqa: E402
from flexarm_bringup.regress.making import update_case  # noqa: E402
from flexarm_bringup.regress.pinned import open_pinned, pin  # noqa: E402

GOLDEN = Path(__file__).parent / "golden" / "single_link"
COMMANDS = "/flexarm/joint_commands"


@pytest.fixture
def case(tmp_path: Path) -> Path:
    return Path(shutil.copytree(GOLDEN, tmp_path / "cases" / "single_link"))


def expect(case: Path, **changes: Any) -> None:
    """Change the expectations of a case."""
    path = case / EXPECT_FILE
    path.write_text(yaml.safe_dump({**yaml.safe_load(path.read_text()), **changes}))


def refusal(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """Return the one line with which a command ends with 2."""
    capsys.readouterr()
    assert cli.main(["regress", *arguments]) == 2
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("flexarm regress: ")]
    (line,) = lines
    return line


def test_the_golden_bags_are_laid_out_as_rosbag2_does() -> None:
    assert faults(GOLDEN / "bag") == [] and faults(GOLDEN / "golden") == []


@pytest.mark.slow
def test_a_bag_that_ros2_bag_record_wrote_is_a_case_once_the_arm_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = check_bag(GOLDEN / "bag")
    topics = {topic.name: (topic.type, list(topic.qos)) for topic in bag.topics}
    path = write_version(tmp_path / "recorded", 5, "sqlite3", topics, bag.records)
    described = tmp_path / "as_recorded.yaml"  # the shipped arm may have changed since
    described.write_text(bag.custom["description"], encoding="utf8")
    arm = ("--manipulator", str(described), "--preset", "geared")
    new = ("--new", str(tmp_path / "cases" / "recorded"), "--from", str(path))
    assert "does not say with which description" in refusal(capsys, *new)
    assert not (tmp_path / "cases" / "recorded").exists()
    assert cli.main(["regress", *new, *arm]) == 0
    assert cli.main(["regress", str(tmp_path / "cases")]) == 0
    direct = ("--new", str(tmp_path / "direct"), "--from", str(GOLDEN / "bag"))
    assert cli.main(["regress", *direct, *arm]) == 0
    made, expected = (open_pinned(read_case(tmp_path / name).golden) for name in ("cases/recorded", "direct"))
    assert made.records == expected.records


@pytest.mark.slow
def test_an_update_says_what_moved_and_then_the_case_passes(
    case: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    update_case(case)  # by the last bits: another machine has others
    before = (case / EXPECT_FILE).read_text()
    assert cli.main(["regress", str(case), "--update"]) == 0
    assert "nothing moved" in capsys.readouterr().out
    assert (case / EXPECT_FILE).read_text() == before
    PLANTED["a weight"].plant(monkeypatch)
    assert cli.main(["regress", str(case)]) == 1
    capsys.readouterr()
    assert cli.main(["regress", str(case), "--update"]) == 0
    said = capsys.readouterr().out
    assert "single_link: what moved" in said and "effort" in said
    assert cli.main(["regress", str(case)]) == 0
    monkeypatch.undo()
    assert cli.main(["regress", str(case)]) == 1


@pytest.mark.slow
def test_what_moved_is_the_largest_change_of_every_field(case: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    PLANTED["sign of an output row"].plant(monkeypatch)
    moved = {(item.topic.rpartition("/")[2], item.field): item for item in update_case(case).moved}
    item = moved["model", "c_pos"]
    model = decode(next(r for r in check_bag(case / "bag").records if r.name.endswith("/model")))
    row = [name.partition(".")[0] for name in model.output_names].index("root_strain")
    gauge = model.c_pos.reshape(len(model.output_names), -1)[row]
    assert item.change == pytest.approx(2.0 * abs(gauge).max(), rel=1e-6)  # another sign
    assert item.messages == 1


@pytest.mark.slow
def test_a_divergence_is_drawn_and_reported(
    case: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    PLANTED["camera stamped 1 ms late"].plant(monkeypatch)
    page, report = tmp_path / "page.html", tmp_path / "report.json"
    files = ["--html", str(page), "--json", str(report), "--png", str(tmp_path / "pictures")]
    assert cli.main(["regress", str(case.parent), *files]) == 1
    assert (tmp_path / "pictures" / "single_link.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in page.read_text() and "found - expected" in page.read_text()
    found = json.loads(report.read_text())
    assert not found["passed"]
    assert found["cases"][0]["first"]["topic"] == "/flexarm/modal_state"


@pytest.mark.slow
def test_the_worst_of_several_cases_decides_and_each_is_told(
    case: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(case, case.parent / "broken")
    (case.parent / "broken" / "bag" / "metadata.yaml").unlink()
    PLANTED["a lost topic"].plant(monkeypatch)
    assert cli.main(["regress", str(case.parent)]) == 2
    said = capsys.readouterr().out
    assert "0 of 2 cases pass" in said
    assert "cannot be judged" in said and "/flexarm/end_effector: 1 message(s) missing" in said


@pytest.mark.slow
def test_no_clock_has_a_say(case: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("time", "monotonic", "perf_counter", "thread_time", "process_time"):
        ticks = iter(range(10**9))
        monkeypatch.setattr(time, name, lambda ticks=ticks: 3.0 * next(ticks))
        monkeypatch.setattr(time, f"{name}_ns", lambda ticks=ticks: 3 * 10**9 * next(ticks))
    assert cli.main(["regress", str(case)]) == 0


@pytest.mark.slow
def test_a_message_lost_at_the_very_end_is_named(case: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shutil.rmtree(case / "golden")
    bag = check_bag(GOLDEN / "golden")
    last = max(i for i, record in enumerate(bag.records) if record.name == COMMANDS)
    more = copy_bag(bag, case / "golden", [*bag.records, bag.records[last]])
    write_case(replace(read_case(case), golden=pin(more)))
    assert cli.main(["regress", str(case)]) == 1
    assert f"{COMMANDS}: 1 message(s) missing" in capsys.readouterr().out


UNREADABLE: dict[str, tuple[dict[str, Any], str]] = {
    "another format": ({"format": "theirs"}, "format: 'theirs': expected one of flexarm-regress/1"),
    "an unknown key": ({"tolerance": []}, "tolerance: []: unknown key"),
    "a negative tolerance": (
        {"tolerances": [{"field": "*", "atol": -1.0}]},
        "atol: -1.0: must be at least 0",
    ),
    "a tolerance that is no number": ({"tolerances": [{"field": "*", "rtol": "some"}]}, "rtol: 'some'"),
    "NaN as tolerance": ({"tolerances": [{"field": "*", "atol": float("nan")}]}, "tolerances.0.atol: nan"),
    "no SHA-256": ({"bag": {"path": "bag", "sha256": {}, "counts": {"/x": 1}}}, "at least one SHA-256"),
    "an unknown manipulator": ({"manipulator": "hexapod"}, "hexapod"),
    "a preset without its manipulator": ({"preset": "geared"}, "preset: 'geared': needs a manipulator"),
    "settings that are refused": ({"settings": {"controller": {"horizon": "far"}}}, "horizon: 'far' is not"),
    "a setting that is a date": (
        {"settings": {"controller": {"law": date(2020, 1, 1)}}},
        "settings: {'controller': {'law': datetime.date(2020, 1, 1)}}: expected numbers, texts",
    ),
    "a marker that is no text": ({"markers": [1]}, "markers: [1]: expected a list of texts"),
}


@pytest.mark.parametrize(
    "name", [pytest.param(k, marks=[] if i < 3 else [pytest.mark.slow]) for i, k in enumerate(UNREADABLE)]
)
def test_expectations_that_are_not_understood_end_with_2_and_one_line(
    name: str, case: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    changes, reason = UNREADABLE[name]
    expect(case, **changes)
    assert reason in refusal(capsys, str(case))


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ((), "give a folder of cases, or --new CASE and --from BAG"),
        (("--new", "x"), "give a folder of cases"),
        (("nowhere",), "nowhere: no case here"),
        (("--new", "x", "--from", "nowhere"), "nowhere: no such folder"),
        (("--new", "x", "--from", str(GOLDEN / "bag"), "--settings", "{"), "--settings: is not JSON"),
        (("--new", "x", "--from", str(GOLDEN / "bag"), "--settings", "[]"), "expected parameters by node"),
        (
            ("--new", "x", "--from", "y", "--settings", '{"controller": {"law": "pd"}, "controller": {}}'),
            "--settings: key 'controller' is given twice; give it once",
        ),
        (
            ("--new", "x", "--from", "y", "--settings", '{"controller": {"law": "pd", "law": "lqr"}}'),
            "--settings: key 'law' is given twice; give it once",
        ),
        (("--new", "x", "--from", "y", "--settings", "[" * 100_000), "--settings: is nested too deeply"),
        (("--new", "x", "--from", "y", "--preset", "geared"), "--preset: 'geared': needs --manipulator"),
        (("--new", str(GOLDEN), "--from", str(GOLDEN / "bag")), "exists already"),
    ],
)
def test_arguments_that_lead_nowhere_are_refused(
    arguments: tuple[str, ...], reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert reason in refusal(capsys, *arguments)


def test_an_end_that_is_no_time_is_refused_with_what_is_allowed(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        refusal(capsys, "--new", "x", "--from", str(GOLDEN / "bag"), "--until", "0")
    assert "--until: '0': expected a number, above 0" in capsys.readouterr().err


@pytest.mark.slow
def test_a_case_can_be_of_other_settings_and_of_the_beginning_of_a_bag(tmp_path: Path) -> None:
    folder = tmp_path / "pd"
    settings = json.dumps({"controller": {"law": "pd"}})
    more = ["--settings", settings, "--until", "0.3", "--about", "Joint PD.", "--mark", "slow"]
    assert cli.main(["regress", "--new", str(folder), "--from", str(GOLDEN / "bag"), *more]) == 0
    made = read_case(folder)
    assert (made.about, made.markers, json.loads(made.settings)) == (
        "Joint PD.",
        ("slow",),
        json.loads(settings),
    )
    assert made.bag.counts["/flexarm/tick"] == 60
    assert cli.main(["regress", str(folder)]) == 0
    expect(folder, settings={})
    assert cli.main(["regress", str(folder)]) == 1
