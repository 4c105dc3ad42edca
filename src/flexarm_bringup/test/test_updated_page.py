"""Identified modes are told also where no description, or no settings for it, come of them."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flexarm_bringup.cli import main
from flexarm_bringup.identify import command, updated_page
from flexarm_bringup.identify.updated_page import Updated, with_update
from flexarm_bringup.page.report import Column, Page, Table
from flexarm_model.identification.model_update import Update
from flexarm_model.identification.unknown import Unknown
from flexarm_model.reading.config import load_config

STIFFNESS = "bodies.strip.pieces.0.youngs_modulus"
FIT = "Description fitted to the modes"
UNTOLD = "the data tell none of the parameters: there is nothing to write"
MODES = Page(
    "Modes", "Lead.", [Table("Modes", [Column("f")], [["12 Hz"]])], remarks={"read it so": ["plainly"]}
)


def update(changes: dict[str, str]) -> Update:
    """Return what a fit says of one parameter."""
    one, small = np.ones((1, 1)), np.full(1, 0.01)
    return Update((Unknown(STIFFNESS, 210.0, "GPa", 0.3),), small, small, one, one, small, small, changes)


def asked(folder: Path) -> argparse.Namespace:
    """Return the options of an update of the single link and of settings for it."""
    return argparse.Namespace(
        files=[], also=[], fit=[STIFFNESS], manipulator="single_link", preset="", pose=[], motors="free",
        update=folder / "mine.yaml", retune=folder / "moves.yaml",
    )  # fmt: skip


def raising(error: Exception) -> Any:
    """Return a function that raises it, whatever it is given."""

    def refuse(*_: object) -> None:
        raise error

    return refuse


RESULT = SimpleNamespace(own_fit="of the modes", is_reciprocal=True)
REFUSED = SimpleNamespace(fit=SimpleNamespace(refusal="it grows"))
FULL = OSError(28, "No space left on device", "mine.yaml")


@pytest.mark.parametrize(
    ("result", "halves", "stubs", "said", "fitted"),
    [
        (
            SimpleNamespace(own_fit=None),
            None,
            {},
            "no mode was identified: there is nothing to fit to",
            False,
        ),
        (RESULT, REFUSED, {}, "the identified model is refused, nothing is fitted to it: it grows", False),
        (RESULT, None, {"fit_description": raising(ValueError("none is near"))}, "none is near", False),
        (RESULT, None, {}, UNTOLD, True),
        (RESULT, None, {"write_description": raising(FULL)}, str(FULL), True),
    ],
)
def test_the_page_stays_and_says_why_nothing_was_written(
    result: Any, halves: Any, stubs: dict[str, Any], said: str, fitted: bool,
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    """Of an arm of imported bodies the data told none: a minute of tests ended in a line without a mode."""
    stubs = {"fit_description": lambda *_: (update({}), None), "retune": pytest.fail, **stubs}
    for name, stub in stubs.items():
        monkeypatch.setattr(updated_page, name, stub)
    found = with_update(MODES, result, asked(tmp_path), [], halves)
    assert found.unmet.startswith(said) and found.written is None and not list(tmp_path.iterdir())
    assert found.page.remarks == {"read it so": ["plainly"], "Not written": [found.unmet]}
    titles = [item.title for item in found.page.items if isinstance(item, Table)]
    assert titles[-1] == "Modes" and (FIT in titles) == fitted


def test_a_description_that_was_written_stays_where_no_settings_are_found_for_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(updated_page, "fit_description", lambda *_: (update({STIFFNESS: "200 GPa"}), None))
    monkeypatch.setattr(updated_page, "retune", raising(ValueError("there are no moves")))
    found = with_update(MODES, RESULT, asked(tmp_path), [], None)  # type: ignore[arg-type]
    assert (found.unmet, found.written) == ("there are no moves", tmp_path / "mine.yaml")
    assert f"wrote {found.written}" in found.page.remarks["Written"][0]
    assert any(STIFFNESS in line for line in load_config(found.written or Path()).fitted)


def test_the_page_is_published_before_the_reason_and_the_exit_code_is_2(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    source = SimpleNamespace(responses=SimpleNamespace(outputs=()), estimator="H1", set_ups=())
    stubs = {
        "read_sources": source, "identify": None, "judge_halves": None, "build_page": MODES,
        "with_halves": MODES, "with_update": Updated(MODES, None, UNTOLD),
    }  # fmt: skip
    for name, stub in stubs.items():
        monkeypatch.setattr(command, name, lambda *_, stub=stub: stub)
    report = tmp_path / "page.json"
    given = ["--manipulator", "single_link", "--update", str(tmp_path / "mine.yaml"), "--json", str(report)]
    assert main(["identify", "x.npz", *given]) == 2
    told = capsys.readouterr()
    assert "12 Hz" in told.out and told.err == f"flexarm identify: {UNTOLD}\n"
    page = json.loads(report.read_text())
    assert page["tables"][0]["title"] == "Modes"
    assert page["remarks"]["fitted"]  # of the description that there is
