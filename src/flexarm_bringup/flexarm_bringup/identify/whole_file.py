"""Files that are written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def written_whole(path: Path, text: str) -> Iterator[Path]:
    """Give a file with the text beside ``path``, which it replaces at the end; an error leaves that be.

    Args:
        path: Where the text belongs.
        text: All of it.
    """
    written = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        written.write_text(text, encoding="utf-8")
        yield written
        written.replace(path)
    finally:
        written.unlink(missing_ok=True)
