"""Find the data files of this package."""

from __future__ import annotations

from pathlib import Path

from flexarm_model.reading.share import share_folders

PACKAGE = "flexarm_bringup"


def share_path(relative: str) -> Path:
    """Return the path of a data file, e.g. ``config/manipulators/single_link.yaml``.

    Raises:
        FileNotFoundError: It is in none of the places; the message lists them.
    """
    looked = list(share_folders(PACKAGE))
    for folder in looked:
        if (folder / relative).exists():
            return folder / relative
    raise FileNotFoundError(f"{relative} is in none of: {', '.join(map(str, looked))}")
