"""What a node keeps over its crashes: one text per node, in a folder of the run that who starts it names.

Who starts nodes makes a new folder for every run, so nothing of one run gets into another, not even of two
that run at the same time. Without a folder the text lives as long as the process.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

MARK = "FLEXARM_KEPT"
_SUFFIX = ".kept"


def begin(folder: Path) -> dict[str, str]:
    """Return what tells the nodes of a run about its folder, which no other run may have."""
    return {MARK: str(folder.absolute())}


class Kept:
    """The text of one node."""

    def __init__(self, node: str, environment: Mapping[str, str] = os.environ) -> None:
        """Find its place.

        Args:
            node: Full name, "/flexarm/estimator".
            environment: Names the folder.
        """
        folder, name = environment.get(MARK, ""), node.strip("/").replace("/", ".")
        self._place = Path(folder) / f"{name}{_SUFFIX}" if folder else None
        self._own: str | None = None

    def read(self) -> str:
        """Return what was kept last, by this process or by one before; empty where none has kept any.

        Raises:
            OSError, UnicodeDecodeError: It is there and cannot be read.
        """
        if self._own is not None:
            return self._own
        if self._place is None or not self._place.exists():
            return ""
        return self._place.read_text(encoding="utf-8")

    def keep(self, text: str) -> None:
        """Keep another text, whole or not at all.

        Raises:
            OSError: It cannot be written; it lives as long as the process.
        """
        self._own = text
        if self._place is not None:
            written = self._place.with_suffix(".new")
            written.write_text(text, encoding="utf-8")
            written.replace(self._place)
