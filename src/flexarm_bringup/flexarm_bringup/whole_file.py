"""Files that are written whole or not at all."""

from __future__ import annotations

import errno
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

    Raises:
        OSError: It cannot be written, or ``path`` is a device or a pipe, whose place the file would take.
    """
    if path.exists() and not path.is_file():
        raise OSError(errno.EINVAL, "is no regular file", str(path))
    written = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        written.write_text(text, encoding="utf-8")
        yield written
        written.replace(path)
    finally:
        written.unlink(missing_ok=True)
