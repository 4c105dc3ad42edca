"""No case vanishes: whatever became of its expectations, it is found, and judging says what is wrong."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

import flexarm_pytest
from flexarm_bringup.regress.case import read_case
from flexarm_bringup.regress.finding import find_cases, is_ours
from flexarm_model.settings.strict_yaml import ConfigError

OURS = "format: flexarm-regress/1\n"


def add_case(folder: Path, text: str | None = OURS, bags: tuple[str, ...] = ("bag", "golden")) -> Path:
    """Make a folder with expectations, or none, and folders of bags beside them."""
    folder.mkdir(parents=True)
    if text is not None:
        (folder / "expect.yaml").write_text(text)
    for name in bags:
        (folder / name).mkdir()
    return folder


def test_a_file_of_another_project_is_no_case_unless_it_is_asked_for(tmp_path: Path) -> None:
    theirs = add_case(tmp_path / "theirs", "format: theirs\n", ())
    with pytest.raises(ConfigError, match="no case here"):
        find_cases(tmp_path)
    assert find_cases(theirs) == [theirs]
    ours = add_case(tmp_path / "ours", OURS, ())
    emptied = add_case(
        tmp_path / "emptied", "", ("bag",)
    )  # by a full disk, say: the bag says that it is ours
    assert find_cases(tmp_path) == [emptied, ours]


def test_a_case_without_expectations_is_found_and_says_so(tmp_path: Path) -> None:
    bare = add_case(tmp_path / "bare", None)
    whole = add_case(tmp_path / "whole")
    add_case(tmp_path / "half", None, ("bag",))  # a bag somewhere is none
    assert find_cases(tmp_path) == [bare, whole]
    with pytest.raises(ConfigError, match="bare/expect.yaml: cannot be read .No such file"):
        read_case(bare)


def test_cases_behind_links_are_found_once_and_loops_end(tmp_path: Path) -> None:
    elsewhere = add_case(tmp_path / "elsewhere" / "arm").parent
    cases = tmp_path / "cases"
    real = add_case(cases / "real")
    (cases / "linked").symlink_to(elsewhere)
    (cases / "again").symlink_to(real)
    (cases / "loop").symlink_to(cases)
    assert find_cases(cases) == [cases / "linked" / "arm", real]


def test_a_folder_that_cannot_be_looked_through_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    add_case(tmp_path / "whole")
    locked = add_case(tmp_path / "group" / "locked").parent
    scandir = os.scandir

    def refuse(path: str) -> object:
        if Path(path) == locked:
            raise PermissionError(13, "Permission denied", path)
        return scandir(path)

    monkeypatch.setattr(os, "scandir", refuse)
    with pytest.raises(ConfigError, match=f"^{locked}: cannot be looked through .*Permission denied"):
        find_cases(tmp_path)


def test_a_bag_that_cannot_be_entered_spoils_its_own_case_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cases = [add_case(tmp_path / name) for name in ("one", "two")]
    scandir, looked = os.scandir, []
    monkeypatch.setattr(os, "scandir", lambda path: looked.append(Path(path).name) or scandir(path))
    assert find_cases(tmp_path) == cases
    assert "bag" not in looked and "golden" not in looked


@pytest.mark.parametrize("bags", [(), ("bag",), ("golden",), ("bag", "golden")])
@pytest.mark.parametrize("text", [OURS, "format: theirs\n", "", None])
def test_plugin_and_command_have_the_same_rule(
    text: str | None, bags: tuple[str, ...], tmp_path: Path
) -> None:
    path = add_case(tmp_path / "case", text, bags) / "expect.yaml"
    expected = bool(bags) or text in (OURS, None)  # what cannot be read is not passed over
    assert is_ours(path) is flexarm_pytest.is_ours(path) is expected
