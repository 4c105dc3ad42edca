"""What a bag says about itself: the code and the configuration that made it."""

from __future__ import annotations

import subprocess
from pathlib import Path

UNKNOWN = "unknown"


def provenance(manipulator: str, description: Path, preset: str, settings: str) -> dict[str, str]:
    """Return the custom data of a bag; enough to run it through the same code again.

    Args:
        manipulator: Name of the manipulator.
        description: Its YAML file, kept whole.
        preset: Preset in use.
        settings: Parameters that differ from their defaults, by node, as JSON.
    """
    return {
        "git": git_hash(),
        "manipulator": manipulator,
        "preset": preset,
        "settings": settings,
        "description": description.read_text(encoding="utf8"),
    }


def git_hash() -> str:
    """Return the commit that this file belongs to, with "-dirty" after local changes."""
    command = ["git", "describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"]
    try:
        folder = Path(__file__).resolve().parent
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    except OSError:  # no git
        return UNKNOWN
    return done.stdout.strip() or UNKNOWN
