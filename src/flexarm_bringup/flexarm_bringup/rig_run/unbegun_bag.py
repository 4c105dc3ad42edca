"""A bag into which nothing was written, because its recorder was asked to end while it started."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from flexarm_bringup.bags.bag_writer import DATA_FILE, ORIGIN_FILE


def is_unbegun(bag: Path) -> bool:
    """Return whether a folder has no bag in it, or one without a byte of data."""
    data = bag / DATA_FILE
    return not data.exists() or not data.stat().st_size


def remove_unbegun(bag: Path) -> None:
    """Take away what such a bag has left, so that its folder may be named again; other files stay."""
    if not (bag / DATA_FILE).is_file() or not is_unbegun(bag):
        return
    for name in (DATA_FILE, ORIGIN_FILE):
        (bag / name).unlink(missing_ok=True)
    with suppress(OSError):  # there is more in it
        bag.rmdir()
