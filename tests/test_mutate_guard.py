"""The folder that the guard's mutation run lays out holds all that it imports, and the guard's own tests."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from mutate_guard import exchanges, guards_code, guards_tests, lay_out

BARE = ("-S", "-E")  # neither installed packages nor PYTHONPATH: what is not laid out is not found


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Lay out what mutmut gets."""
    folder = tmp_path_factory.mktemp("mutation")
    lay_out(folder, guards_code(), guards_tests())
    return folder


def imported(folder: Path) -> subprocess.CompletedProcess[str]:
    modules = sorted(
        ".".join(path.relative_to(folder).with_suffix("").parts)
        for path in folder.glob("flexarm_controller/**/*.py")
        if path.name != "__init__.py"
    )
    line = f"import sys; sys.path.insert(0, {str(folder)!r}); import {', '.join(modules)}"
    return subprocess.run([sys.executable, *BARE, "-c", line], capture_output=True, text=True, check=False)


def test_what_is_laid_out_imports_by_itself(folder: Path) -> None:
    assert (folder / "flexarm_controller/guard.py").exists()
    found = imported(folder)
    assert found.returncode == 0, found.stderr


def test_a_part_that_is_not_laid_out_would_be_missed(folder: Path) -> None:
    part = folder / "flexarm_controller/guarding/axis_label.py"
    code = part.read_text()
    part.unlink()
    try:
        assert "axis_label" in imported(folder).stderr
    finally:
        part.write_text(code)


@pytest.mark.slow
def test_the_tests_that_are_laid_out_are_collected_and_pass(folder: Path) -> None:
    line = [sys.executable, "-E", "-m", "pytest", "-q", "-p", "no:cacheprovider", "-k", "not imports_nothing"]
    found = subprocess.run([*line, "tests"], cwd=folder, capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout[-3000:]


def test_code_and_tests_follow_from_what_is_imported() -> None:
    code = {path.stem for path in guards_code()}
    assert {"guard", "axis_label", "checks", "plausibility", "stop_brake", "strain_gauges"} <= code
    assert not {"derive", "pose_loads", "guard_settings"} & code  # they know models; the guard does not
    tests = {path.stem for path in guards_tests()}
    assert {"test_guard", "test_guard_gauges", "test_guard_rest", "test_plausibility"} <= tests
    assert not {"test_guard_limits", "test_guard_random", "test_guard_exchange"} & tests


def test_of_the_exchange_its_file_alone_is_mutated_with_all_of_the_package_that_it_imports(
    tmp_path: Path,
) -> None:
    lay_out(tmp_path, *exchanges())
    (settings,) = re.findall(r"do_not_mutate = (.*)", (tmp_path / "pyproject.toml").read_text())
    files = {str(path.relative_to(tmp_path)) for path in tmp_path.glob("flexarm_controller/**/*.py")}
    code = {name for name in files if not name.endswith("__init__.py")}
    assert {"flexarm_controller/guard.py", "flexarm_controller/guarding/pose_loads.py"} <= code
    assert code - set(json.loads(settings)) == {"flexarm_controller/guard_exchange.py"}
    assert [path.name for path in tmp_path.glob("tests/test_*.py")] == ["test_guard_exchange.py"]
