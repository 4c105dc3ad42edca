"""The package's data files are found wherever it runs from."""

from pathlib import Path

import pytest

from flexarm_bringup import share
from flexarm_bringup.share import share_path


def test_the_reference_tables_are_found() -> None:
    assert share_path("config/reference/seed002_table1.csv").is_file()


def test_a_missing_file_is_named_with_the_places_looked_at() -> None:
    with pytest.raises(FileNotFoundError, match="nothing.yaml is in none of: .*flexarm_bringup"):
        share_path("nothing.yaml")


def test_the_first_folder_that_has_the_file_wins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("empty", "first", "second"):
        (tmp_path / name).mkdir()
    for name in ("first", "second"):
        (tmp_path / name / "a.yaml").write_text(name)
    folders = [tmp_path / name for name in ("empty", "first", "second")]
    monkeypatch.setattr(share, "share_folders", lambda package: iter(folders))
    assert share_path("a.yaml").read_text() == "first"
