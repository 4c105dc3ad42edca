"""The arm that a case names: one that comes along, by its name, or a file, by its path from the case.

So a case is the same arm wherever it is judged from, and goes to another machine together with its file.
"""

from __future__ import annotations

import os
from pathlib import Path

from flexarm_bringup.regress.case import EXPECT_FILE, Case
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.strict_yaml import ConfigError


def name_from(folder: Path, manipulator: str) -> str:
    """Return what a case is to say of a manipulator: a name and an absolute path as they are.

    Args:
        folder: Of the case.
        manipulator: A name, or a path from the working directory.

    Raises:
        ConfigError: There is no such manipulator.
    """
    path = find_manipulator(manipulator)
    if path != Path(manipulator):
        return manipulator
    if not path.is_file():
        raise ConfigError(f"manipulator: '{manipulator}': no such file")
    if path.is_absolute():
        return manipulator
    return os.path.relpath(path.parent.resolve() / path.name, folder.resolve())


def arm_of(case: Case) -> Path:
    """Return the file of the manipulator that a case names.

    Raises:
        ConfigError: There is none; the message names the case's file, its key and value.
    """
    place = case.folder / EXPECT_FILE
    try:
        path = find_manipulator(case.manipulator)
    except ConfigError as error:
        raise ConfigError(f"{place}: {error}") from None
    if path == Path(case.manipulator):
        path = case.folder / path
    if not path.is_file():
        allowed = f"no such file as {path}; expected a path from the folder of the case, or a name"
        raise ConfigError(f"{place}: manipulator: '{case.manipulator}': {allowed}")
    return path
