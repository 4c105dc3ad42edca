"""The files that a manipulator's description names, kept in the bag beside it.

A description with imported bodies names files of nodes, matrices or reduced bodies, relative to itself. A bag
keeps them in its folder ``description``, where they lie to each other as they lay when it was recorded:

    description/arms/manipulator.yaml       the description, its name is always this one
    description/meshes/link/mass.mtx        named "../meshes/link/mass.mtx" in it

Files that are named by an absolute path are not kept; they are looked for where they were.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from flexarm_model.settings.strict_yaml import read_yaml

FOLDER = "description"
NAME = "manipulator.yaml"
KEYS = ("file", "nodes", "rows", "set")  # what a body calls its files


def files_to_keep(description: Path) -> dict[str, Path]:
    """Return the description and the files that it names, by where they belong in a bag.

    It is empty where no file is named; one that a preset names and that is not there is left out.

    Raises:
        ConfigError: The description cannot be read.
    """
    named = named_files(description)
    if not named:
        return {}
    home = Path(os.path.abspath(description)).parent
    places = {name: Path(os.path.normpath(home / name)) for name in named}
    root = Path(os.path.commonpath([home, *(place.parent for place in places.values())]))
    kept = {place.relative_to(root): description.parent / name for name, place in places.items()}
    kept[home.relative_to(root) / NAME] = description
    return {str(Path(FOLDER) / place): path for place, path in kept.items() if path.is_file()}


def named_files(description: Path) -> list[str]:
    """Return the relative names of files in a description, those of its presets too.

    Raises:
        ConfigError: The description cannot be read.
    """
    content = read_yaml(description)
    parts = (content.get("bodies"), content.get("presets"))
    return sorted({name for part in parts for name in _names(part) if not Path(name).is_absolute()})


def kept_files(bag: Path) -> dict[str, Path]:
    """Return the files that a bag has kept, by where they belong in a bag."""
    found = sorted(path for path in (bag / FOLDER).rglob("*") if path.is_file())
    return {str(path.relative_to(bag)): path for path in found}


def kept_description(bag: Path) -> Path | None:
    """Return the description that a bag keeps with the files it names; None if it keeps none."""
    return next(iter(sorted((bag / FOLDER).rglob(NAME))), None)


def _names(value: Any) -> Iterator[str]:
    if isinstance(value, Mapping):
        for key, inner in value.items():
            if isinstance(inner, str) and str(key).rpartition(".")[2] in KEYS:
                yield inner
            else:
                yield from _names(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from _names(inner)
