"""What a node keeps over its crashes: found again by the next process of the same run, and by no other."""

from pathlib import Path

import pytest

from flexarm_model.process.kept import Kept, begin

NAME = "/flexarm/estimator"


def test_a_process_finds_what_the_one_before_it_kept_last(tmp_path: Path) -> None:
    run = begin(tmp_path)
    first = Kept(NAME, run)
    assert first.read() == ""
    for text in ("one", "another"):
        first.keep(text)
        assert first.read() == Kept(NAME, run).read() == text
    assert Kept("/left/estimator", run).read() == ""
    assert [path.name for path in tmp_path.iterdir()] == ["flexarm.estimator.kept"]


def test_to_name_a_folder_again_takes_nothing_from_who_uses_it(tmp_path: Path) -> None:
    Kept(NAME, begin(tmp_path)).keep("of a run that goes on")
    assert Kept(NAME, begin(tmp_path)).read() == "of a run that goes on"


def test_without_a_folder_it_lives_as_long_as_the_process() -> None:
    kept = Kept(NAME, {})
    kept.keep("text")
    assert kept.read() == "text"
    assert Kept(NAME, {}).read() == ""


def test_what_cannot_be_written_is_told_and_kept_by_the_process(tmp_path: Path) -> None:
    kept = Kept(NAME, begin(tmp_path / "gone"))
    with pytest.raises(OSError, match="gone"):
        kept.keep("text")
    assert kept.read() == "text"
