"""Mutation score of the guard: every test that it has against every small change of its code.

    python -m venv mutation && mutation/bin/pip install mutmut==3.8.1 pytest hypothesis
    mutation/bin/python tests/mutate_guard.py

What is copied follows from what the guard imports. It works in a temporary folder, takes some ten minutes,
prints score and survivors, and fails below 90 %. The guard's exchange of messages needs ROS and models, so it
is done for itself, in the environment of flexarm:

    ./flexarm shell
    python -m pip install --target mutation_ros mutmut==3.8.1
    PYTHONPATH=$PWD/mutation_ros:$PYTHONPATH python tests/mutate_guard.py --exchange
"""

from __future__ import annotations

import argparse
import ast
import importlib.util
import json
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Collection
from pathlib import Path

PACKAGE = Path(__file__).resolve().parents[1] / "src/flexarm_controller"
TEST = PACKAGE / "test"
GUARD = ("flexarm_controller.guard", "flexarm_controller.guarding.strain_gauges")
EXCHANGE = "flexarm_controller.guard_exchange"
WANTED = 90.0  # percent
SETTINGS = """
[tool.mutmut]
source_paths = ["flexarm_controller"]
also_copy = ["tests"]
do_not_mutate = {others}
pytest_add_cli_args_test_selection = ["tests"]
pytest_add_cli_args = ["-k", "not imports_nothing", {plugins}]
"""
WITHOUT = ("cacheprovider", "launch_testing", "launch_ros")  # plugins; those of ROS know no other ones
KILLED = ("killed", "timeout", "segfault", "suspicious")


def lay_out(folder: Path, code: Collection[Path], tests: Collection[Path]) -> None:
    """Copy code, its tests and what they use, and nothing else of the package, to where mutmut finds them."""
    others = [path for path in set().union(*map(needs, tests)) if not _is_test(path) and path not in code]
    for path in (*code, *others):
        place = folder / path.relative_to(PACKAGE)
        place.parent.mkdir(parents=True, exist_ok=True)
        (place.parent / "__init__.py").touch()
        shutil.copy(path, place)
    (folder / "tests").mkdir()
    for path in {TEST / "conftest.py", *tests, *filter(_is_test, set().union(*map(needs, tests)))}:
        shutil.copy(path, folder / "tests")
    plain = json.dumps(sorted(str(path.relative_to(PACKAGE)) for path in others))
    plugins = ", ".join(f'"-p", "no:{name}"' for name in WITHOUT)
    settings = SETTINGS.format(others=plain, plugins=plugins)
    (folder / "pyproject.toml").write_text(settings)


def guards_code() -> set[Path]:
    """Return the files of the guard and of its gauges, and all that they import of flexarm."""
    files = {file for name in GUARD if (file := _file_of(name))}
    return files.union(*map(needs, files))


def exchanges() -> tuple[set[Path], list[Path]]:
    """Return the file of the guard's exchange of messages, and that of its tests."""
    file = _file_of(EXCHANGE)
    assert file is not None
    return {file}, [TEST / f"test_{file.name}"]


def guards_tests() -> list[Path]:
    """Return the tests of the guard's code that need nothing else but pytest and the standard library.

    A test that needs more (a model, NumPy, hypothesis) is not of the guard alone and is left out.
    """
    code = guards_code()
    return [
        path
        for path in sorted(TEST.glob("test_*.py"))
        if code & {_file_of(name) for name in _imported(path)}
        and all(_is_at_hand(name) for each in (path, *needs(path)) for name in _imported(each))
    ]


def needs(path: Path) -> set[Path]:
    """Return the files of the package and its tests that a file imports, those that they import included."""
    found: set[Path] = set()
    waiting = [path]
    while waiting:
        for name in _imported(waiting.pop()):
            file = _file_of(name)
            if file is not None and file not in found and file != path:
                found.add(file)
                waiting.append(file)
    return found


def _imported(path: Path) -> set[str]:
    """Return the modules that a file imports; of ``from package import module`` both: either may be one."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf8"))):
        if isinstance(node, ast.Import):
            names |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module}
            names |= {full for name in node.names if _file_of(full := f"{node.module}.{name.name}")}
    return names


def _file_of(name: str) -> Path | None:
    """Return the file of a module of the package or of its tests; None: it is neither, or a package."""
    place = PACKAGE if name.startswith("flexarm_controller.") else TEST
    file = place / f"{name.replace('.', '/')}.py"
    return file if file.is_file() else None


def _is_at_hand(name: str) -> bool:
    """Tell if a module is there without anything but pytest installed; the package itself is laid out."""
    is_package = (PACKAGE / name.replace(".", "/")).is_dir()
    if is_package or _file_of(name) is not None or name == "pytest":
        return True
    return name.partition(".")[0] in sys.stdlib_module_names


def _is_test(path: Path) -> bool:
    return path.parent == TEST


def main() -> int:
    """Run mutmut and print what came of it; 2 where this Python has no mutmut."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--exchange", action="store_true", help="of guard_exchange instead; needs ROS")
    settings = parser.parse_args()
    wanted = ["mutmut", *(["flexarm_interfaces"] if settings.exchange else [])]
    if missing := [name for name in wanted if importlib.util.find_spec(name) is None]:
        parser.error(f"{sys.executable} has no {' and no '.join(missing)}")
    mutmut = [sys.executable, "-m", "mutmut"]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        lay_out(folder, *(exchanges() if settings.exchange else (guards_code(), guards_tests())))
        subprocess.run([*mutmut, "run"], cwd=folder, check=True)
        told = subprocess.run(
            [*mutmut, "results", "--all", "true"], cwd=folder, check=True, capture_output=True
        )
        found = re.findall(r"^\s*(\S+): ([\w ]+)$", told.stdout.decode(), re.MULTILINE)
        alive = [mutant for mutant, state in found if state not in KILLED]
        for mutant in alive:
            subprocess.run([*mutmut, "show", mutant], cwd=folder, check=False)
    score = 100.0 * (1.0 - len(alive) / len(found)) if found else 0.0
    print(f"{len(found) - len(alive)} of {len(found)} mutants found: {score:.1f} %, {WANTED:.0f} % wanted")
    return int(score < WANTED)


if __name__ == "__main__":
    sys.exit(main())
