"""What a power cut or a bad disk did to a data file costs what it hit, and is told."""

import struct
from pathlib import Path

import numpy as np
import pytest
from bag_fixture import PERIOD_NS, WRITTEN, joint_state

from flexarm_bringup import cli
from flexarm_bringup.bags.bag_recovery import Recovery, recover_bag
from flexarm_bringup.bags.bag_writer import CHUNK, DATA_FILE, BagWriter
from flexarm_bringup.bags.mcap_records import MAGIC, MESSAGE, pieces

JOINTS = "/flexarm/joint_states"
COUNT, PAGE = 3000, 4096
HEADER, CHUNK_HEADER, MESSAGE_HEADER = 9, 40, 22  # bytes: of a record, and of what it holds
FRAME = HEADER + MESSAGE_HEADER + 4 + 8  # where the length of frame_id stands in the record of a message
SEED = 5


def stamped(k: int) -> bytes:
    return joint_state(k * PERIOD_NS, float(k))


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Return a bag that was never closed."""
    writer = BagWriter(tmp_path / "bag", WRITTEN, {})
    for k in range(COUNT):
        writer.write(JOINTS, k * PERIOD_NS, stamped(k))
    writer.flush()
    return tmp_path / "bag"


PER_CHUNK = CHUNK // (len(stamped(0)) + HEADER + MESSAGE_HEADER) + 1


def with_bytes(path: Path, at: int, changed: bytes) -> None:
    data = bytearray((path / DATA_FILE).read_bytes())
    data[at : at + len(changed)] = changed
    (path / DATA_FILE).write_bytes(data)


def intact(recovery: Recovery) -> int:
    """Return how many messages are as they were written."""
    written = {k * PERIOD_NS: stamped(k) for k in range(COUNT)}
    return sum(written[record.log_time_ns] == record.cdr for record in recovery.bag.records)


@pytest.mark.parametrize("share", [0.2, 0.5, 0.7])
def test_a_page_of_zeros_in_the_middle_is_told_with_its_byte(
    path: Path, share: float, tmp_path: Path
) -> None:
    """Messages were missing, and the exit code was 0."""
    at = int(share * (path / DATA_FILE).stat().st_size) // PAGE * PAGE
    with_bytes(path, at, bytes(PAGE))
    found = recover_bag(path, tmp_path / "new")
    assert COUNT - PER_CHUNK <= intact(found) < COUNT
    (doubt,) = (text for text in found.doubts if "damaged at byte" in text)
    told = int(doubt.split("damaged at byte ")[1].split(":")[0])
    assert at - PAGE < told < at + PAGE


def messages(path: Path) -> list[int]:
    """Return where the messages of the first chunk begin in the file."""
    data = memoryview((path / DATA_FILE).read_bytes())
    _, chunk, *_ = pieces(data[len(MAGIC) :], len(MAGIC))
    inside = pieces(chunk.content[CHUNK_HEADER:], chunk.at + HEADER + CHUNK_HEADER)
    return [piece.at for piece in inside if piece.opcode == MESSAGE]


@pytest.mark.parametrize("which", [0, 300, 700])
def test_random_bytes_over_several_messages_are_told(path: Path, which: int, tmp_path: Path) -> None:
    with_bytes(path, messages(path)[which] + 50, np.random.default_rng(SEED).bytes(300))
    found = recover_bag(path, tmp_path / "new")
    assert found.doubts
    assert intact(found) >= COUNT - PER_CHUNK


def test_one_message_that_does_not_decode_is_left_out_and_told(
    path: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """For its sake nothing at all was saved, and the folder to create was named as the one at fault."""
    with_bytes(path, messages(path)[7] + FRAME, b"\xff" * 4)
    assert cli.main(["recover", str(path), "--output", str(tmp_path / "new")]) == 1
    said = " ".join(capsys.readouterr().out.split())
    assert f"messages left out that cannot be decoded: 1, first {JOINTS} at {7 * PERIOD_NS} ns" in said
    assert intact(recover_bag(path, tmp_path / "again")) == COUNT - 1


def test_a_tail_of_zeros_costs_no_more_than_the_tail(path: Path, tmp_path: Path) -> None:
    size = (path / DATA_FILE).stat().st_size
    with_bytes(path, size - 3 * PAGE, bytes(3 * PAGE))
    found = recover_bag(path, tmp_path / "new")
    assert intact(found) >= COUNT - PER_CHUNK
    assert any("damaged at byte" in text for text in found.doubts)


@pytest.mark.parametrize(
    ("offset", "changed"), [(HEADER, b"\x77\x77"), (HEADER + 6, struct.pack("<Q", 2**62))]
)
def test_a_message_of_no_topic_or_of_another_time_is_left_out_and_told(
    path: Path, offset: int, changed: bytes, tmp_path: Path
) -> None:
    with_bytes(path, messages(path)[3] + offset, changed)
    found = recover_bag(path, tmp_path / "new")
    assert intact(found) == len(found.bag.records) == COUNT - 1
    (doubt,) = found.doubts
    assert doubt.startswith("messages left out") and doubt.endswith(": 1")
