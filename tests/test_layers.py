"""Packages depend in one direction only, and only thin files know ROS."""

from __future__ import annotations

import ast
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[1] / "src"
ALLOWED = {
    "flexarm_model": set(),
    "flexarm_estimator": {"flexarm_model"},
    "flexarm_controller": {"flexarm_model"},
    "flexarm_bringup": {"flexarm_model", "flexarm_estimator", "flexarm_controller"},
}
# ament_index_python is not among them: it looks up folders and works without a graph.
ROS_PACKAGES = {"rclpy", "launch", "launch_ros", "builtin_interfaces", "rcl_interfaces"}


def is_ros(module: str) -> bool:
    return module in ROS_PACKAGES or module.endswith(("_msgs", "_srvs")) or module == "flexarm_interfaces"


def may_import_ros(path: Path) -> bool:
    return path.name.endswith("_node.py") or path.name in ("node.py", "conversions.py")


def imported_modules(code: str) -> Iterator[tuple[int, str]]:
    """Yield line and top-level name of every absolute import, also of those inside functions."""
    for node in ast.walk(ast.parse(code)):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name.split(".")[0]) for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            yield node.lineno, (node.module or "").split(".")[0]


def modules_of(package: str) -> list[Path]:
    return sorted((SOURCE / package / package).rglob("*.py"))


@pytest.mark.parametrize("package", ALLOWED)
def test_package_imports_only_the_packages_below_it(package: str) -> None:
    allowed = ALLOWED[package] | {package, "flexarm_interfaces"}
    wrong = [
        f"{path.relative_to(SOURCE)}:{line} imports {module}"
        for path in modules_of(package)
        for line, module in imported_modules(path.read_text())
        if module.startswith("flexarm_") and module not in allowed
    ]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("package", ALLOWED)
def test_only_node_and_conversion_files_import_ros(package: str) -> None:
    wrong = [
        f"{path.relative_to(SOURCE)}:{line} imports {module}"
        for path in modules_of(package)
        if not may_import_ros(path)
        for line, module in imported_modules(path.read_text())
        if is_ros(module)
    ]
    assert not wrong, "\n".join(wrong)


def test_walk_sees_the_imports_it_judges() -> None:
    code = "import rclpy.node\ndef f():\n    from sensor_msgs.msg import Imu\nfrom . import std_msgs\n"
    assert [module for _, module in imported_modules(code) if is_ros(module)] == ["rclpy", "sensor_msgs"]
    assert all(modules_of(package) for package in ALLOWED)


@pytest.mark.parametrize("package", ALLOWED)
def test_importing_a_package_limits_blas_before_numpy_is_loaded(package: str) -> None:
    code = f"import sys, os, {package}; print(os.environ['OMP_NUM_THREADS'], 'numpy' in sys.modules)"
    environ = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environ, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["1", "False"]


INITIALISING = re.compile(r"^\s*rclpy\.init\(", re.MULTILINE)
CHECKED = re.compile(r"\bcheck_(security|unsecured)\(")
BEHIND = {  # a command that has checked starts them, or calls them after ``free_domains``
    "driver_node.py", "flooder_node.py", "forger_node.py", "idle_node.py", "run_node.py",
}  # fmt: skip


def test_nobody_opens_a_ros_domain_without_a_look_at_the_security_that_is_asked_for() -> None:
    texts = {path: path.read_text() for package in ALLOWED for path in modules_of(package)}
    opening = {path for path, text in texts.items() if INITIALISING.search(text)}
    wrong = {path.name for path in opening if not CHECKED.search(texts[path])} - BEHIND
    assert len(opening) >= len(BEHIND) and not wrong, f"use flexarm_model.ros.tool_node: {wrong}"
