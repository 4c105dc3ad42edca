"""Mutation score of the guard: every test that it has against every small change of its code.

    python -m venv mutation && mutation/bin/pip install mutmut==3.8.1 pytest hypothesis
    mutation/bin/python tests/mutate_guard.py

It works in a temporary folder, takes some ten minutes, prints score and survivors, and fails below 90 %.
"""

from __future__ import annotations

import argparse
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1] / "src/flexarm_controller"
CODE = ("guard", *(f"guarding/{name}" for name in ("checks", "energy", "joint_range", "limits", "loads")))
CODE += ("guarding/messages", "guarding/plausibility", "guarding/rest_watch", "guarding/stop_brake")
USED = ("due_commands",)  # by the tests; left as it is
TESTS = (
    "test_guard",
    "test_guard_age",
    "test_guard_braking",
    "test_guard_checks",
    "test_guard_plausibility",
    "test_guard_ranges",
    "test_guard_rest",
    "test_plausibility",
    "guarded_arm",
    "conftest",
)
WANTED = 90.0  # percent
SETTINGS = """
[tool.mutmut]
source_paths = ["flexarm_controller"]
also_copy = ["tests"]
do_not_mutate = ["*/due_commands.py"]
pytest_add_cli_args_test_selection = ["tests"]
pytest_add_cli_args = ["-k", "not imports_nothing", "-p", "no:cacheprovider"]
"""
KILLED = ("killed", "timeout", "segfault", "suspicious")


def lay_out(folder: Path) -> None:
    """Copy the guard and its tests, and nothing else, to where mutmut finds them."""
    for name in (*CODE, *USED):
        place = folder / "flexarm_controller" / f"{name}.py"
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(PACKAGE / "flexarm_controller" / f"{name}.py", place)
        (place.parent / "__init__.py").touch()
    (folder / "tests").mkdir()
    for name in TESTS:
        shutil.copy(PACKAGE / "test" / f"{name}.py", folder / "tests")
    (folder / "pyproject.toml").write_text(SETTINGS)


def main() -> int:
    """Run mutmut and print what came of it; 2 without mutmut beside this Python."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.parse_args()
    mutmut = Path(sys.executable).with_name("mutmut")
    if not mutmut.exists():
        parser.error(f"no mutmut beside {sys.executable}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        lay_out(folder)
        subprocess.run([mutmut, "run"], cwd=folder, check=True)
        told = subprocess.run(
            [mutmut, "results", "--all", "true"], cwd=folder, check=True, capture_output=True
        )
        found = re.findall(r"^\s*(\S+): ([\w ]+)$", told.stdout.decode(), re.MULTILINE)
        alive = [mutant for mutant, state in found if state not in KILLED]
        for mutant in alive:
            subprocess.run([mutmut, "show", mutant], cwd=folder, check=False)
    score = 100.0 * (1.0 - len(alive) / len(found)) if found else 0.0
    print(f"{len(found) - len(alive)} of {len(found)} mutants found: {score:.1f} %, {WANTED:.0f} % wanted")
    return int(score < WANTED)


if __name__ == "__main__":
    sys.exit(main())
