"""Data files are found wherever the package runs from."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from flexarm_bringup import share


def test_manipulators_are_found() -> None:
    assert share.share_path("config/manipulators/single_link.yaml").is_file()


def test_the_environment_comes_before_the_source_tree(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(share, "_ament_share", lambda: None)
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    own = tmp_path / "share" / "flexarm_bringup" / "config" / "own.yaml"
    own.parent.mkdir(parents=True)
    own.write_text("{}")
    assert share.share_path("config/own.yaml") == own
    assert share.share_path("config/manipulators/single_link.yaml").is_relative_to(
        Path(share.__file__).parents[1]
    )


def test_a_missing_file_is_named_with_the_places_searched(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    with pytest.raises(FileNotFoundError, match=f"config/none.yaml is in none of: .*{tmp_path}"):
        share.share_path("config/none.yaml")
