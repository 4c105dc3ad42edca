"""The cases of a folder: none may vanish because its expectations are gone, damaged or out of reach."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

from flexarm_bringup.regress.case import BAG, EXPECT_FILE, FORMAT, GOLDEN
from flexarm_model.settings.strict_yaml import ConfigError

OURS = FORMAT.partition("/")[0]


def find_cases(folder: Path) -> list[Path]:
    """Return the folders of all cases in a folder, by name; the folder itself may be one.

    Links to folders are followed, each folder is looked through once. One with ``bag/`` and ``golden/`` is a
    case, too: judging says that its expectations are missing.

    Raises:
        ConfigError: There is none, or a folder cannot be looked through.
    """
    found = [
        path
        for path, folders, files in _walk(folder)
        if (EXPECT_FILE in files and (path == folder or is_ours(path / EXPECT_FILE)))
        or {BAG, GOLDEN} <= set(folders)
    ]
    if not found:
        raise ConfigError(f"{folder}: no case here: no folder with an {EXPECT_FILE}")
    return sorted(found)


def case_name(case: Path, folder: Path) -> str:
    """Return what a case is called among those of a folder: its path in there, or its own name."""
    return case.resolve().name if case == folder else case.relative_to(folder).as_posix()


def is_ours(expect: Path) -> bool:
    """Return whether an ``expect.yaml`` is of a case; ``flexarm_pytest`` has the same rule.

    One that neither speaks of our format nor has a bag beside it is of another project.
    """
    if any(os.path.isdir(expect.parent / name) for name in (BAG, GOLDEN)):
        return True
    try:
        return OURS in expect.read_text(encoding="utf8", errors="replace")
    except OSError:
        return True  # judging says why it cannot be read


def _walk(folder: Path) -> Iterator[tuple[Path, list[str], list[str]]]:
    """Yield every folder once, with the names of the folders and files in it; not those of bags."""
    if not folder.is_dir():
        return
    seen: set[str] = set()
    for place, folders, files in os.walk(folder, followlinks=True, onerror=_refuse):
        inside = sorted(folders, key=lambda name: (os.path.islink(os.path.join(place, name)), name))
        folders.clear()
        if (real := os.path.realpath(place)) in seen:
            continue
        seen.add(real)
        yield Path(place), inside, files
        is_case = EXPECT_FILE in files or {BAG, GOLDEN} <= set(inside)
        folders += [name for name in inside if not (is_case and name in (BAG, GOLDEN))]


def _refuse(error: OSError) -> None:
    raise ConfigError(f"{error.filename}: cannot be looked through for cases ({error.strerror})")
