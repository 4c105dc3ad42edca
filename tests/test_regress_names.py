"""Cases of one folder name are told apart, and what cannot be written is no pass."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
pytest.importorskip("rclpy", reason="needs ROS")

from planted_changes import PLANTED  # noqa: E402

from flexarm_bringup import cli  # noqa: E402
from flexarm_bringup.regress.finding import case_name  # noqa: E402

GOLDEN = Path(__file__).parent / "golden" / "single_link"


def test_cases_of_one_name_have_a_picture_a_row_and_tables_each(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    PLANTED["a lost topic"].plant(monkeypatch)
    for arm in ("left", "right"):
        shutil.copytree(GOLDEN, tmp_path / "cases" / arm / "case")
    report, pictures = tmp_path / "report.json", tmp_path / "png"
    command = ["regress", str(tmp_path / "cases"), "--json", str(report), "--png", str(pictures)]
    assert cli.main(command) == 1
    drawn = sorted(str(path.relative_to(pictures)) for path in pictures.rglob("*.png"))
    assert drawn == ["left/case.png", "right/case.png"]
    page = json.loads(report.read_text())
    assert [check["name"] for check in page["checks"]] == ["left/case", "right/case"]
    titles = [table["title"] for table in page["tables"]]
    assert len(set(titles)) == len(titles) and titles[0].startswith("left/case: ")
    said = capsys.readouterr().out
    assert f"drew {pictures / 'left' / 'case.png'}" in said


def test_a_case_asked_for_alone_has_its_own_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "case").mkdir()
    monkeypatch.chdir(tmp_path / "case")
    assert case_name(Path(), Path()) == "case"
    assert case_name(tmp_path / "case", tmp_path / "case") == "case"


@pytest.mark.parametrize("option", ["--json", "--html"])
def test_a_report_that_cannot_be_written_ends_with_2(option: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.main(["regress", str(GOLDEN), option, "/dev/full"]) == 2
    assert "/dev/full: cannot be written (No space left on device)" in capsys.readouterr().err


def test_a_picture_that_cannot_be_written_ends_with_2_and_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    PLANTED["a lost topic"].plant(monkeypatch)
    (tmp_path / "single_link.png").mkdir()
    assert cli.main(["regress", str(GOLDEN), "--png", str(tmp_path)]) == 2
    assert f"flexarm regress: {tmp_path}: cannot be drawn into: " in capsys.readouterr().err
