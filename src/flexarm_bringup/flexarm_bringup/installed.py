"""Where colcon or the package manager put a package, from the ament index (no ROS import needed)."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

INDEX = "share/ament_index/resource_index/packages"
MIDDLEWARES = "share/ament_index/resource_index/rmw_typesupport"
CHOOSER = "rmw_implementation"  # is in that index and chooses one of the others


def find_package(name: str, environment: Mapping[str, str] = os.environ) -> Path | None:
    """Return the prefix that a package is installed under; None if it is not."""
    for prefix in _prefixes(environment):
        if (prefix / INDEX / name).exists():
            return prefix
    return None


def find_executable(package: str, executable: str, environment: Mapping[str, str] = os.environ) -> Path:
    """Return what ``ros2 run package executable`` starts.

    Raises:
        FileNotFoundError: It is not installed; the message says where it was looked for.
    """
    prefix = find_package(package, environment)
    if prefix is None:
        looked = ", ".join(map(str, _prefixes(environment))) or "AMENT_PREFIX_PATH, which is empty"
        raise FileNotFoundError(f"package {package} is not installed in {looked}")
    path = prefix / "lib" / package / executable
    if not path.is_file():
        raise FileNotFoundError(f"package {package} has no executable {executable} ({path})")
    return path


def middlewares(environment: Mapping[str, str] = os.environ) -> list[str]:
    """Return the names of the middlewares that are installed, where rmw_implementation looks for them."""
    folders = (prefix / MIDDLEWARES for prefix in _prefixes(environment))
    found = {entry.name for folder in folders if folder.is_dir() for entry in folder.iterdir()}
    return sorted(found - {CHOOSER})


def _prefixes(environment: Mapping[str, str]) -> list[Path]:
    return [Path(item) for item in environment.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if item]
