"""The files of a bag, checked before one of them is parsed."""

from __future__ import annotations

import hashlib
from pathlib import Path

from flexarm_bringup.bags.bag_metadata import instead_of_metadata
from flexarm_bringup.bags.bag_writer import CHECKSUM_FILE, DATA_FILE, BagError

DATABASE = b"SQLite format 3\0"  # first bytes of one (SQLite's file format, 1.3.1)
# what stands beside one that is being written; a log that was done with begins with 0, or is empty (5.1, 4.1)
LOGS = ("-wal", "-journal")


def check_files(path: Path) -> bool:
    """Return whether our recorder left a checksum of the data file, which then fits.

    Raises:
        BagError: This is no bag, or not what was recorded.
        OSError: A file may not be read.
    """
    if not path.is_dir():
        raise BagError(
            f"{path}: no such folder" if not path.exists() else f"{path}: is a file, not a bag folder"
        )
    if not (path / "metadata.yaml").is_file():
        raise BagError(f"{path}: has no metadata.yaml ({instead_of_metadata(path)})")
    _check_logs(path)
    return _check_sum(path)


def _check_logs(path: Path) -> None:
    """Refuse a database beside which a log stands that SQLite would go by: it is read without."""
    for end in LOGS:
        for log in sorted(path.glob(f"*{end}")):
            base = log.with_name(log.name.removesuffix(end))
            is_database = base.is_file() and _begin(base, len(DATABASE)) in (b"", DATABASE)
            if is_database and _begin(log, 1).strip(b"\0"):
                why = f"{log.name} belongs to it (its writer was killed, or still writes)"
                cure = f"`sqlite3 {base} 'SELECT count(*) FROM messages'` brings it in order"
                raise BagError(f"{path}: {base.name} is not all that was recorded, {why}; {cure}")


def _begin(path: Path, count: int) -> bytes:
    """Return the first bytes of a file."""
    with path.open("rb") as file:
        return file.read(count)


def _check_sum(path: Path) -> bool:
    """Return whether our recorder left a checksum; BagError where it is not that of the data file."""
    data = path / DATA_FILE
    if not (path / CHECKSUM_FILE).is_file():
        return False  # recorded by another program
    expected = (path / CHECKSUM_FILE).read_text(encoding="utf8", errors="replace").split()
    if not data.is_file():
        if DATA_FILE not in expected:
            return False  # somebody else's, of other files
        raise BagError(f"{path}: its data file {DATA_FILE} is missing")
    if not data.stat().st_size:
        raise BagError(f"{path}: its data file {DATA_FILE} is empty")
    if expected[:1] != [hashlib.sha256(data.read_bytes()).hexdigest()]:
        raise BagError(
            f"{path}: {DATA_FILE} is not what was recorded (SHA-256 differs: cut short or changed)"
        )
    return True
