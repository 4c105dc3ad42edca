"""Folders that nodes and tools write to without being told: log files, compiled code."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path

from flexarm_bringup.doctor.finding import Finding
from flexarm_bringup.processes.surroundings import LOGS, defaults
from flexarm_model.numeric.library_cache import CACHE, cache_folder


def look_at_places(environment: Mapping[str, str] = os.environ) -> Iterator[Finding]:
    """Yield whether they can be written; nothing is left in them."""
    name, logs = _log_folder(environment)
    if trouble := refusal_of(logs):
        text = f"{name}: {logs}: {trouble}; flexarm rig and its nodes do not start"
        yield Finding("FAULT", "log files", text, f"export {LOGS}=FOLDER, one that can be written")
    else:
        yield Finding("ok", "log files", str(logs))
    chosen = environment.get(CACHE)
    cache = Path(chosen) if chosen else cache_folder()
    if trouble := refusal_of(cache):
        text = f"{CACHE}: {cache}: {trouble}; compiled code is not kept, slower code runs instead"
        yield Finding("hint", "compiled code", text, f"export {CACHE}=FOLDER, one that can be written")
    else:
        yield Finding("ok", "compiled code", str(cache))


def refusal_of(folder: Path) -> str:
    """Return why a folder, or the first above it that is there, cannot be written; empty where it can."""
    try:
        there = next(place for place in (folder, *folder.absolute().parents) if place.exists())
        tempfile.TemporaryFile(dir=there).close()  # has no name: a process that is killed leaves nothing
    except OSError as error:
        return f"cannot be written ({error.strerror})"
    return ""


def _log_folder(environment: Mapping[str, str]) -> tuple[str, Path]:
    """Return where rcl writes log files, and what says so (rcl_logging_interface, logging_dir.c)."""
    if chosen := environment.get(LOGS) or defaults(environment).get(LOGS):
        return LOGS, Path(chosen).expanduser()
    if home := environment.get("ROS_HOME"):
        return "ROS_HOME", Path(home).expanduser() / "log"
    return "HOME", Path(environment["HOME"]) / ".ros" / "log"
