"""A page says the same in text, JSON and HTML."""

from __future__ import annotations

import argparse
import errno
import json
import math
import os
import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest

from flexarm_bringup.arguments import STDOUT
from flexarm_bringup.exit_codes import UNUSABLE
from flexarm_bringup.page.check import Check
from flexarm_bringup.page.column_names import column_names
from flexarm_bringup.page.figures import drawing, to_figure
from flexarm_bringup.page.page_template import PAGE, STYLE, render
from flexarm_bringup.page.report import Column, Page, Table, add_report_arguments, publish

TABLE = Table(
    "Sizes & shapes",
    [Column("name"), Column("mass\n[kg]", ".2f"), Column("settled [s]", ".1f")],
    [["<strip>", 1.0, math.inf], ["hub", None, 0.25]],
    ["a < b"],
)


def page(passed: bool = True) -> Page:
    return Page("Title", "Lead.", [TABLE], [Check("size", "< 1", "0.5", passed)], {"Assumed": ["nothing"]})


def test_columns_of_text_are_aligned() -> None:
    assert TABLE.to_text().splitlines() == [
        "Sizes & shapes",
        "",
        "           mass",
        "  name     [kg]  settled [s]",
        "  ───────  ────  ───────────",
        "  <strip>  1.00        never",
        "  hub         –          0.2",
        "  · a < b",
    ]


def test_a_text_of_a_bag_steers_no_terminal_and_keeps_its_row() -> None:
    """A sensor's name from a bag cleared the screen, and one with a line feed broke the table."""
    table = Table("Sensors", [Column("name"), Column("says")], [["\x1b[2Jcamera", "a\nb"]], ["\x07bell"])
    text = Page(
        "Title", "Lead.", [table], [Check("\x9bname", "1", "\x1bc", True)], {"Of": ["\x00"]}
    ).to_text()
    assert all(line.isprintable() for line in text.split("\n"))
    assert "  ?[2Jcamera  a b" in text.splitlines()
    assert "  · ?bell" in text.splitlines()


def test_json_keeps_full_numbers_and_is_strict() -> None:
    content = json.loads(json.dumps(page().to_json(), allow_nan=False))
    assert content["tables"][0]["rows"] == [["<strip>", 1.0, "inf"], ["hub", None, 0.25]]
    check = {"name": "size", "wanted": "< 1", "found": "0.5", "passed": True, "excuse": ""}
    assert content["checks"] == [check]
    assert content["passed"] is True


def test_names_of_columns_in_json_bear_the_heading_of_their_group_and_are_unique() -> None:
    titles = ["", "case", "sim [Hz]\nnotes", "\nours", "exp [Hz]\nnotes", "\nours", "mean", "\nof all"]
    names = [
        "",
        "case",
        "sim [Hz] notes",
        "sim [Hz] ours",
        "exp [Hz] notes",
        "exp [Hz] ours",
        "mean",
        "of all",
    ]
    assert column_names(titles) == names
    assert column_names(["a\nb", "\nb", "\nb", "c", "c"]) == ["a b", "a b (2)", "a b (3)", "c", "c (2)"]
    table = Table("T", [Column("mass\nbefore"), Column("\nafter")], [])
    assert table.to_json()["columns"] == ["mass before", "mass after"]


def test_html_escapes_and_holds_every_cell() -> None:
    html = page().to_html()
    assert "&lt;strip&gt;" in html
    assert "<strip>" not in html
    assert all(text in html for text in ("1.00", "never", "Assumed", "1 of 1 bounds met"))
    assert "http" not in html  # self-contained


@pytest.mark.parametrize(
    ("passed", "excuse", "verdict", "summary", "code"),
    [
        (True, "", "ok", "1 of 1 bounds met", 0),
        (True, "the machine slept", "ok", "1 of 1 bounds met", 0),
        (False, "", "MISSED", "0 of 1 bounds met", 1),
        (False, "the machine slept", "not judged", "0 of 1 bounds met, 1 not judged", 0),
    ],
)
def test_what_was_not_met_with_an_excuse_is_told_with_it_and_is_no_failure(
    passed: bool, excuse: str, verdict: str, summary: str, code: int, capsys: pytest.CaptureFixture[str]
) -> None:
    told = Page("Title", "Lead.", checks=[Check("size", "< 1", "2", passed, excuse)])
    assert told.check_table().rows[0][0] == verdict
    assert told.summary == summary and summary in told.to_html()
    assert publish(told, argparse.Namespace(json=None, html=None)) == code
    assert ("not judged: the machine slept" in capsys.readouterr().out) == (verdict == "not judged")


def test_figures_take_the_colour_of_the_text_and_scale() -> None:
    with drawing() as plot:
        plot.add_subplot().plot([0.0, 1.0], [0.0, 1.0])
        figure = to_figure(plot, "A line & its caption")
    root = ET.fromstring(figure.svg)
    assert root.get("viewBox")
    assert root.get("width") is None
    assert "currentColor" in figure.svg
    assert "A line &amp; its caption" in Page("T", "L", [figure]).to_html()


def test_no_two_drawings_of_a_page_share_an_id_and_every_reference_is_met() -> None:
    figures = []
    for caption in ("Strips", "Other strips"):
        with drawing() as plot:
            axes = plot.subplots()
            axes.broken_barh([(0.0, 1.0)], (0.0, 1.0))
            axes.fill_between([0.0, 1.0], [0.0, 1.0], label="a band")
            axes.legend()
            figures.append(to_figure(plot, caption))
    text = Page("T", "L", figures).to_html()
    ids = re.findall(r'\bid="([^"]*)"', text)
    assert len(set(ids)) == len(ids)
    assert set(re.findall(r'(?:url\(|href=")#([^")]+)', text)) == set(ids) != set()


@pytest.mark.parametrize("passed", [True, False])
def test_a_missed_check_is_exit_code_1(
    passed: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    parser = argparse.ArgumentParser()
    add_report_arguments(parser)
    args = parser.parse_args(["--json", str(tmp_path / "a.json"), "--html", str(tmp_path / "a.html")])
    assert publish(page(passed), args) == (0 if passed else 1)
    assert json.loads((tmp_path / "a.json").read_text())["passed"] is passed
    assert ("MISSED" in capsys.readouterr().out) is not passed
    assert (tmp_path / "a.html").read_text().startswith("<!doctype html>")


def test_json_for_programs_is_alone_on_stdout(capsys: pytest.CaptureFixture[str]) -> None:
    assert publish(page(), argparse.Namespace(json=STDOUT, html=None)) == 0
    assert json.loads(capsys.readouterr().out)["title"] == "Title"


def test_a_file_that_cannot_be_written_in_the_end_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert publish(page(), argparse.Namespace(json=None, html=Path("/dev/full"))) == UNUSABLE
    assert "/dev/full: cannot be written (No space left on device)" in capsys.readouterr().err


def test_rows_must_fit_the_columns() -> None:
    with pytest.raises(ValueError, match="has not 1 cells"):
        Table("t", [Column("a")], [[1, 2]])


def test_the_style_of_a_page_is_what_a_browser_reads() -> None:
    """Browsers decode no entities between style tags: fonts, captions and colours of verdicts were lost."""
    style = render(PAGE, page=Page("title", "lead")).split("<style>")[1].split("</style>")[0]
    assert style.strip() == STYLE.strip()
    assert "&" not in style


def test_a_disk_that_fills_up_takes_no_earlier_report(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Half of the new one stood in its place, and the page was not tried."""
    before, after = tmp_path / "report.json", tmp_path / "report.html"
    before.write_text("{}", encoding="utf-8")
    write = Path.write_text

    def fill(path: Path, text: str, **kwargs: Any) -> int:
        if path.suffix == ".json":
            write(path, text[:10], **kwargs)
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(path, text, **kwargs)

    monkeypatch.setattr(Path, "write_text", fill)
    assert publish(page(), argparse.Namespace(json=before, html=after)) == UNUSABLE
    assert before.read_text(encoding="utf-8") == "{}" and "</html>" in after.read_text(encoding="utf-8")
    assert sorted(tmp_path.iterdir()) == [after, before]
    assert "report.json: cannot be written (No space left on device)" in capsys.readouterr().err
