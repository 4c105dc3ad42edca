"""Twenty seconds of soak: the nodes move, break, are killed, come back, and are counted.

Whether memory and guard cycles keep their bounds is told by ``./flexarm soak`` on a quiet machine.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [pytest.mark.ros, pytest.mark.slow]

TRIES = 3  # a loaded machine may need longer to bring a killed node back than the soak lasts


def soaked(folder: Path) -> dict[str, dict[str, float]]:
    """Return the tables of a short soak, first column to last, by title."""
    command = [
        sys.executable, "-m", "flexarm_bringup.cli", "soak", "--minutes", "0.4", "--warm-up", "1",
        "--fault-every", "2", "--kill-every", "9", "--json", str(folder / "soak.json"), "--log", str(folder),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode in (0, 1), done.stderr
    page = json.loads((folder / "soak.json").read_text(encoding="utf8"))
    passed = {check["name"]: check["passed"] for check in page["checks"]}
    assert passed["it came to its end"] and passed["ended by itself"], page["checks"]
    return {table["title"]: {row[0]: row[-1] for row in table["rows"]} for table in page["tables"]}


def test_a_short_soak_moves_breaks_kills_and_tells(tmp_path: Path) -> None:
    for attempt in range(TRIES):
        folder = tmp_path / str(attempt)
        folder.mkdir()
        tables = soaked(folder)
        done = tables["done"]
        if done.get("moves done") and any(name.endswith("killed") for name in done):
            break
    assert done["moves done"] >= 1 and done["faults of sensors"] >= 3
    assert any(name.endswith("killed") for name in done)
    assert sum(tables["stops of the guard, by reason"].values()) >= 1
    assert set(tables["memory"]) == {"model", "estimator", "controller", "guard", "rig"}
    assert 0.0 < tables["tip: estimate from truth"]["moving"] < 100.0  # mm; an estimate, not nonsense
