"""``flexarm reproduce all``: what is written where."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from flexarm_bringup import reproduce
from flexarm_bringup.cli import main
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Page


@pytest.fixture(autouse=True)
def two_papers(monkeypatch: pytest.MonkeyPatch) -> None:
    pages = {
        "000": Page("First", "of two", checks=[Check("a", "1", "1", True)]),
        "001": Page("Second", "of two", checks=[Check("b", "1", "2", False)]),
    }
    monkeypatch.setattr(reproduce, "compare_all", lambda figures: pages)


def test_json_of_all_papers_on_the_standard_output_is_one_object(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Objects one after the other are what no reader of JSON takes."""
    assert main(["reproduce", "all", "--json", "-", "--html", str(tmp_path / "a.html")]) == 1
    said = capsys.readouterr()
    assert {seed: page["title"] for seed, page in json.loads(said.out).items()} == {
        "000": "First",
        "001": "Second",
    }
    assert "Second" in said.err and sorted(path.name for path in tmp_path.iterdir()) == [
        "a-000.html",
        "a-001.html",
    ]


def test_files_of_all_papers_bear_their_numbers(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reproduce", "all", "--json", str(tmp_path / "a.json")]) == 1
    titles = [json.loads((tmp_path / f"a-{seed}.json").read_text())["title"] for seed in ("000", "001")]
    assert titles == ["First", "Second"] and "All papers" in capsys.readouterr().out


@pytest.mark.parametrize("option", ["--json", "--html"])
def test_a_file_of_one_paper_that_cannot_be_written_is_refused_before_anything_is_computed(
    option: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It was told after all papers had been computed."""
    monkeypatch.setattr(reproduce, "compare_all", lambda figures: pytest.fail("computed"))
    (tmp_path / "a-001.out").mkdir()
    assert main(["reproduce", "all", option, str(tmp_path / "a.out")]) == UNUSABLE
    assert f"'{tmp_path / 'a-001.out'}': cannot be written" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["a-001.out"]


def test_pages_of_all_papers_do_not_go_to_the_standard_output(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Five pages one after the other are no page."""
    monkeypatch.setattr(reproduce, "compare_all", lambda figures: pytest.fail("computed"))
    assert main(["reproduce", "all", "--html", "-"]) == UNUSABLE
    said = capsys.readouterr()
    assert "--html -: expected the name of a file" in said.err and not said.out
