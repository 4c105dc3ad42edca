"""Golden bag and expectations of a case replaced together: both, or neither when anything fails.

The new bag and the new ``expect.yaml`` are written beside the old ones first. Who is killed while they change
places leaves the old bag beside them, and the next update puts it back or throws it away. What is protected
against writing stays: that is looked at before anything is changed.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from flexarm_bringup.bags.bag_reader import Bag
from flexarm_bringup.regress.case import EXPECT_FILE, Case, read_case, write_case
from flexarm_bringup.regress.pinned import is_pinned, pin

NEW, OLD = ".new", ".old"  # ends of names


def replace_golden(case: Case, write: Callable[[Path], Bag]) -> str:
    """Let another bag be what is expected of a case.

    Args:
        case: Of before.
        write: Writes the bag into a folder that it creates, and reads it back.

    Returns:
        Why the bag of before is still there, and where; empty: it is not.

    Raises:
        OSError, BagError: Something cannot be written; the case is as it was.
    """
    golden, expect = case.golden.path, case.folder / EXPECT_FILE
    fresh, draft = _beside(golden, NEW), _beside(expect, NEW)
    try:
        _remove(fresh)  # of an update that was interrupted
        _refuse_protected(expect, golden)
        pinned = replace(pin(write(fresh)), path=golden)
        write_case(replace(case, golden=pinned), draft.name)
        return _swap(fresh, golden, lambda: draft.replace(expect))
    finally:
        _remove(fresh)
        draft.unlink(missing_ok=True)


def finish_replacing(folder: Path) -> None:
    """Bring what an interrupted update left of a case in order: the bag that its expectations mean stays.

    Raises:
        ConfigError: The expectations are not understood.
        OSError: What was left cannot be removed.
    """
    golden = read_case(folder).golden
    old = _beside(golden.path, OLD)
    if not old.exists():
        return
    if not is_pinned(golden):
        _remove(golden.path)
        old.rename(golden.path)
    _remove(old)


def _refuse_protected(expect: Path, golden: Path) -> None:
    """Refuse to replace a file, or a folder of which something could not be removed afterwards."""
    for path in (expect, golden, *(path for path in golden.rglob("*") if path.is_dir())):
        if not os.access(path, os.W_OK):
            raise PermissionError(f"{path}: may not be written")


def _swap(fresh: Path, golden: Path, then: Callable[[], object]) -> str:
    """Put a folder in the place of another and do what belongs to it, or neither; say what is left of it."""
    old = _beside(golden, OLD)
    golden.rename(old)
    try:
        fresh.rename(golden)
        then()
    except BaseException:
        with suppress(OSError):  # it has not come that far
            golden.rename(fresh)
        old.rename(golden)
        raise
    try:
        _remove(old)
    except OSError as error:  # both have been replaced
        return str(error)
    return ""


def _beside(path: Path, end: str) -> Path:
    return path.with_name(f"{path.name}{end}")


def _remove(folder: Path) -> None:
    """Remove a folder, or the link to one, if it is there.

    Raises:
        OSError: It cannot be removed; the text names it.
    """
    try:
        if folder.is_symlink():
            folder.unlink()
        elif folder.exists():
            shutil.rmtree(folder)
    except OSError as error:
        raise OSError(f"{folder}: cannot be removed ({error.strerror or error})") from error
