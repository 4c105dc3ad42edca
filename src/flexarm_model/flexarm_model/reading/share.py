"""Where a package's data files (manipulators, parameters, reference tables) are.

In order: the ament index of a sourced workspace, ``share/`` of the Python environment, the source tree.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path


def share_folders(package: str) -> Iterator[Path]:
    """Yield the folders that may hold a package's data, the preferred one first."""
    indexed = _ament_share(package)
    if indexed is not None:
        yield indexed
    yield Path(sys.prefix) / "share" / package
    yield Path(__file__).resolve().parents[3] / package


def _ament_share(package: str) -> Path | None:
    try:
        from ament_index_python.packages import PackageNotFoundError, get_package_share_directory
    except ImportError:
        return None
    try:
        return Path(get_package_share_directory(package))
    except (OSError, PackageNotFoundError):  # no AMENT_PREFIX_PATH; no such package
        return None
