"""Row about parameter files: every node refuses every wrong one, soon, and says what and where."""

from __future__ import annotations

import os
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path

from flexarm_bringup.fault_drill.bad_parameters import BadFile, bad_files
from flexarm_bringup.fault_drill.findings import Finding
from flexarm_bringup.fault_drill.row import Row
from flexarm_bringup.fault_drill.system_stand import SystemStand
from flexarm_bringup.installed import find_executable
from flexarm_bringup.parameters_command import NODES

SOON = 3.0  # s
REFUSED = 2  # the exit code; a node that ends otherwise has crashed, one without an end ran on
PATIENCE = 60.0  # s for a node that should have ended


@dataclass(frozen=True)
class Refusal:
    """What a node made of a file: its exit code (None: it ran on), how soon [s], what it did not name."""

    file: str
    code: int | None
    after: float
    unnamed: tuple[str, ...]


def refusal(node: str, file: BadFile, folder: Path) -> Refusal:
    """Start a node with a file and wait for its end."""
    package, _, module = NODES[node].split(":")[0].partition(".")
    path = find_executable(package, module.rpartition(".")[2] or module, os.environ)
    line = [str(path), "--ros-args", "--params-file", str(file.write(folder))]
    started = time.monotonic()
    try:
        ended = subprocess.run(line, capture_output=True, text=True, timeout=PATIENCE, check=False)
    except subprocess.TimeoutExpired:
        return Refusal(file.name, None, PATIENCE, file.names)
    said = ended.stdout + ended.stderr
    wanted = (*file.names, file.write(folder).name)
    return Refusal(
        file.name, ended.returncode, time.monotonic() - started, tuple(w for w in wanted if w not in said)
    )


def refusals(stand: SystemStand) -> list[Finding]:
    """Give every node every wrong file."""
    findings = []
    for node in NODES:
        folder = stand.folder()
        tried = [refusal(node, file, folder) for file in bad_files(node)]
        accepted = [f"{r.file} ({r.code})" for r in tried if r.code != REFUSED]
        vague = [f"{r.file} ({', '.join(r.unnamed)})" for r in tried if r.unnamed]
        findings += [
            Finding(_named(f"{node}: of {len(tried)} wrong files not refused", accepted), len(accepted), 0),
            Finding(_named(f"{node}: refusals that do not name file, key and value", vague), len(vague), 0),
            Finding(f"{node}: the slowest refusal", max(r.after for r in tried), SOON, "s"),
        ]
    return findings


def _named(what: str, wrong: list[str]) -> str:
    return f"{what}: {', '.join(wrong)}" if wrong else what


ROWS = (Row(47, "a wrong parameter file", "refused soon, with file, key and what is allowed", refusals, "N"),)
