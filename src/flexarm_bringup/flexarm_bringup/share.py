"""Where the package's own data files (manipulators, parameters, reference tables) are.

In order: the ament index of a sourced workspace, ``share/`` of the Python environment, the source tree.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path

PACKAGE = "flexarm_bringup"


def share_path(relative: str) -> Path:
    """Return the path of a data file, e.g. ``config/manipulators/single_link.yaml``.

    Raises:
        FileNotFoundError: It is in none of the places; the message lists them.
    """
    looked: list[Path] = []
    for folder in _folders():
        if (folder / relative).exists():
            return folder / relative
        looked.append(folder)
    raise FileNotFoundError(f"{relative} is in none of: {', '.join(map(str, looked))}")


def _folders() -> Iterator[Path]:
    indexed = _ament_share()
    if indexed is not None:
        yield indexed
    yield Path(sys.prefix) / "share" / PACKAGE
    yield Path(__file__).resolve().parents[1]


def _ament_share() -> Path | None:
    try:
        from ament_index_python.packages import PackageNotFoundError, get_package_share_directory
    except ImportError:
        return None
    try:
        return Path(get_package_share_directory(PACKAGE))
    except (OSError, PackageNotFoundError):  # no such package; no AMENT_PREFIX_PATH
        return None
