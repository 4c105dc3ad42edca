"""What a recorder left that was killed or ran out of disk: a data file without an index, read as a stream.

Its records are read until the file ends in the middle of one (``mcap_stream``); every message before that is
whole. One that does not decode is left out, and said. A power cut may leave zeros where messages were. The
checksum of a whole file, which our recorder leaves when it closes it, tells of changes but not where.
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import yaml

from flexarm_bringup.bags.bag_copy import copy_bag
from flexarm_bringup.bags.bag_reader import Bag, Record, trouble_decoding
from flexarm_bringup.bags.bag_writer import CHECKSUM_FILE, ORIGIN_FILE, BagError, refuse_inside
from flexarm_bringup.bags.mcap_stream import McapStream

METADATA, INFORMATION = "metadata.yaml", "rosbag2_bagfile_information"
PACKED = ".zstd"  # what --compression-mode file appends to the names of data files


@dataclass(frozen=True)
class Recovery:
    """What was saved.

    Attributes:
        bag: The new bag, read back; its custom data are those that the recorder began with.
        doubts: Sentences about what was left out or is not what was recorded.
    """

    bag: Bag
    doubts: tuple[str, ...] = ()


def recover_bag(path: Path, folder: Path) -> Recovery:
    """Write everything whole of a broken bag into a new one.

    Args:
        path: Folder of the broken bag, with one MCAP file in it.
        folder: To create.

    Raises:
        BagError: There is no such file, or it is compressed; nothing in it is whole; or ``folder`` exists
            or lies in the broken bag.
    """
    if not path.is_dir():
        raise BagError(
            f"{path}: " + ("is a file; expected the folder of a bag" if path.exists() else "no such folder")
        )
    file = _data_file(path)
    refuse_inside(folder, path)
    data, found = file.read_bytes(), McapStream(file)
    found.read(data)
    sound, undecoded = _decodable(found.records)
    doubts = (
        *found.doubts,
        *undecoded,
        *_doubts_of_file(file, data),
        *_doubts_of_count(path, len(sound)),
    )
    if not sound:
        raise BagError("; ".join((f"{file}: holds no whole message of a known type", *doubts)))
    records = tuple(sorted(sound, key=lambda record: record.log_time_ns))
    counts = Counter(record.name for record in records)
    topics = tuple(found.topics.values())
    return Recovery(copy_bag(Bag(path, records, counts, _origin(path), topics), folder, records), doubts)


def _data_file(path: Path) -> Path:
    """Return the one MCAP file of a bag."""
    files = sorted(path.glob("*.mcap"))
    packed = [file for file in sorted(path.glob(f"*.mcap{PACKED}")) if file.with_suffix("") not in files]
    if packed:
        raise BagError(
            f"{path}: compressed as whole files: {', '.join(file.name for file in packed)}; unpack each with "
            "zstd -d, and recover one MCAP file at a time"
        )
    if len(files) != 1:
        other = "; SQLite is not recovered here, ros2 bag reindex does" if any(path.glob("*.db3")) else ""
        raise BagError(f"{path}: has {len(files)} MCAP files, one expected{other}")
    return files[0]


def _decodable(records: Sequence[Record]) -> tuple[list[Record], tuple[str, ...]]:
    """Return the messages that decode, and what is to be said of the others."""
    troubles = {i: trouble for i, record in enumerate(records) if (trouble := trouble_decoding(record))}
    sound = [record for i, record in enumerate(records) if i not in troubles]
    if not troubles:
        return sound, ()
    first = next(iter(troubles.values()))
    return sound, (f"messages left out that cannot be decoded: {len(troubles)}, first {first}",)


def _doubts_of_file(path: Path, data: bytes) -> tuple[str, ...]:
    """Return what the checksum has to say that our recorder leaves beside a file that it closed."""
    try:
        said = (path.parent / CHECKSUM_FILE).read_text(encoding="utf8", errors="replace").split()
    except OSError:
        return ()
    if said[1:] != [path.name] or said[0] == hashlib.sha256(data).hexdigest():
        return ()
    return (f"{path.name} is not what was recorded (SHA-256 differs): any message may be changed or missing",)


def _doubts_of_count(path: Path, count: int) -> tuple[str, ...]:
    """Return what a recorder that closed its bag has to say of a file that was cut off since."""
    told = _metadata(path, "message_count")
    if not isinstance(told, int) or told <= count:
        return ()
    missing = "are missing, damaged or of a type that is not known here"
    return (f"{METADATA} tells of {told} messages: {told - count} {missing}",)


def _metadata(path: Path, key: str) -> object:
    """Return what a recorder that closed its bag has written beside it; None where it has not."""
    try:
        return yaml.safe_load((path / METADATA).read_text(encoding="utf8"))[INFORMATION][key]
    except (OSError, UnicodeDecodeError, yaml.YAMLError, LookupError, TypeError):
        return None


def _origin(path: Path) -> dict[str, str]:
    """Return the custom data that the recorder began with; none where it was another program."""
    try:
        content = json.loads((path / ORIGIN_FILE).read_text(encoding="utf8"))
    except FileNotFoundError:
        content = _metadata(path, "custom_data")  # the recorder has closed its bag
    except (OSError, ValueError):
        return {}
    return {str(key): str(value) for key, value in content.items()} if isinstance(content, dict) else {}
