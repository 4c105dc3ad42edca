"""A bag of a case that may not change: pinned by SHA-256 and number of messages."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from flexarm_bringup.bags.bag_files import check_files
from flexarm_bringup.bags.bag_reader import Bag, check_bag
from flexarm_bringup.bags.bag_writer import CHECKSUM_FILE, BagError

EXPECT_FILE = "expect.yaml"


@dataclass(frozen=True)
class Pinned:
    """A bag that may not change.

    Attributes:
        path: Its folder.
        sha256: Of every file in it and in its folders but the checksum file, by its path in the bag.
        counts: Messages by absolute topic [1].
    """

    path: Path
    sha256: Mapping[str, str]
    counts: Mapping[str, int]


def pin(bag: Bag) -> Pinned:
    """Return what a bag is now."""
    return Pinned(bag.path, _digests(bag.path), {name: count for name, count in bag.counts.items() if count})


def is_pinned(pinned: Pinned) -> bool:
    """Return whether all files of a bag are still those that were pinned."""
    return pinned.path.is_dir() and _digests(pinned.path) == dict(pinned.sha256)


def open_pinned(pinned: Pinned, required: Sequence[str] = ()) -> Bag:
    """Read a bag and prove that it is whole and the one that was pinned.

    Its files are compared with the pin before one of them is parsed: a parser of bytes that were changed
    may do anything.

    Args:
        pinned: What it must be.
        required: Absolute topics that it must have messages of, whatever was pinned.

    Raises:
        BagError: It is not; the text is one line with the reason.
        OSError: A file may not be read.
    """
    check_files(pinned.path)  # what has its own name for what is wrong
    _check_pin(pinned)
    bag = check_bag(pinned.path, required)
    for name, count in pinned.counts.items():
        found = bag.counts.get(name, 0)
        if found != count:
            raise BagError(f"{pinned.path}: {name} has {found} messages, {EXPECT_FILE} says {count}")
    unknown = [name for name, count in bag.counts.items() if count and name not in pinned.counts]
    if unknown:
        raise BagError(f"{pinned.path}: has messages on {unknown[0]}, {EXPECT_FILE} knows of none")
    return bag


def _check_pin(pinned: Pinned) -> None:
    """Refuse a bag with a file that is missing, another or too many."""
    found = _digests(pinned.path)
    for name in sorted({*pinned.sha256, *found}):
        if name not in pinned.sha256:
            text = f"{name} is not among the files of {EXPECT_FILE}; if it is of this bag, add {found[name]}"
            raise BagError(f"{pinned.path}: {text}")
        if pinned.sha256[name] != found.get(name):
            raise BagError(
                f"{pinned.path}: {name} is not the file that {EXPECT_FILE} means (SHA-256 differs)"
            )


def _digests(folder: Path) -> dict[str, str]:
    files = {p.relative_to(folder).as_posix(): p for p in sorted(folder.rglob("*")) if p.is_file()}
    files.pop(CHECKSUM_FILE, None)
    return {name: hashlib.sha256(path.read_bytes()).hexdigest() for name, path in files.items()}
