"""``flexarm reproduce all``: what is written where."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from flexarm_bringup import reproduce
from flexarm_bringup.cli import main
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
