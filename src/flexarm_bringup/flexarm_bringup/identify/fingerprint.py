"""What a fitted description says of a source, so that it can be told apart from another: its hash."""

from __future__ import annotations

import hashlib
from pathlib import Path

DIGITS = 12
METADATA = "metadata.yaml"
RECORDED = {".mcap", ".db3"}  # among the suffixes of a bag's data files


def fingerprint(path: Path) -> str:
    """Return the first digits of the SHA-256 of a file, or of what was recorded in the folder of a bag.

    A folder is hashed by its data files and its metadata, name and content of each, in order of the names:
    what was put beside them later changes nothing.

    Raises:
        OSError: A file cannot be read.
    """
    digest = hashlib.sha256()
    if not path.is_dir():
        digest.update(path.read_bytes())
        return digest.hexdigest()[:DIGITS]
    for file in sorted(file for file in path.iterdir() if _is_recorded(file)):
        digest.update(file.name.encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()[:DIGITS]


def _is_recorded(file: Path) -> bool:
    return file.name == METADATA or not RECORDED.isdisjoint(file.suffixes)
