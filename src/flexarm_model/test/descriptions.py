"""Descriptions that tests write, and what is said of those that are refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

from flexarm_model.reading.config import load_config
from flexarm_model.settings.strict_yaml import ConfigError


def write_arm(folder: Path, content: dict[str, Any]) -> Path:
    """Return the file of a description, written as it is."""
    path = folder / "arm.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return path


def refusal(path: Path) -> str:
    """Return why a description is refused, which begins with its file."""
    with pytest.raises(ConfigError) as caught:
        load_config(path)
    assert str(caught.value).startswith(f"{path}: ")
    return str(caught.value)
