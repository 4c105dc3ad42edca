"""A command ends with the code of its work, whatever its terminal can take."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

FLEXARM = f"'{sys.executable}' -m flexarm_bringup.cli"
GOLDEN = Path(__file__).parents[3] / "tests" / "golden" / "single_link"


def shell(command: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        ["bash", "-c", command],
        env={**os.environ, **environment},
        capture_output=True,
        encoding="utf8",
        errors="replace",
        check=False,
        timeout=600.0,
    )


@pytest.mark.parametrize(
    "closing",
    [
        "<&- >&- 2>&-",
        pytest.param(">&-", marks=pytest.mark.slow),
        pytest.param(">&- --json -", marks=pytest.mark.slow),
    ],
)
def test_closed_streams_change_no_exit_code(closing: str) -> None:
    done = shell(f"{FLEXARM} model single_link {closing}")
    assert done.returncode == 0 and "Traceback" not in done.stderr
    assert shell(f"{FLEXARM} model no_such_arm >&- 2>&-").returncode == 2


@pytest.mark.parametrize("encoding", [pytest.param("latin-1", marks=pytest.mark.slow), "ascii"])
def test_a_terminal_without_the_characters_shows_question_marks(encoding: str) -> None:
    done = shell(f"{FLEXARM} model single_link", PYTHONIOENCODING=encoding)
    assert done.returncode == 0, done.stderr
    assert "????" in done.stdout and "Traceback" not in done.stderr


@pytest.mark.ros
@pytest.mark.unhurried
def test_a_regression_that_passes_does_so_without_a_terminal() -> None:
    pytest.importorskip("rclpy", reason="needs ROS")
    assert shell(f"{FLEXARM} regress {GOLDEN} >&-").returncode == 0
    assert shell(f"{FLEXARM} regress {GOLDEN}", LC_ALL="C", PYTHONUTF8="0").returncode == 0


def test_a_full_disk_is_no_missed_bound() -> None:
    """It ended with a traceback and 1, like an acceptance that was missed."""
    done = shell(f"{FLEXARM} parameters > /dev/full")
    assert done.returncode == 2
    assert done.stderr == "flexarm parameters: output cannot be written: No space left on device\n"
