"""A recorded run through estimator and controller: the same as then, the same every time, or named."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from flexarm_bringup.bags.bag_reader import Bag, Record, check_bag
from flexarm_bringup.bags.bag_writer import CHECKSUM_FILE, DATA_FILE, BagError, BagWriter
from flexarm_bringup.topics import NAMESPACE, find_stream

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
pytest.importorskip("rclpy", reason="needs ROS")

from flexarm_bringup import cli  # noqa: E402
from flexarm_bringup.conversions import deserialise, serialise  # noqa: E402
from flexarm_bringup.regress.case import read_case  # noqa: E402
from flexarm_bringup.regress.pinned import open_pinned  # noqa: E402
from flexarm_bringup.replaying.replay_bag import OUTPUTS, replay  # noqa: E402

# One second of 10 degrees on case A with MPC, recorded over DDS in lockstep (tests/make_golden.py).
CASE = Path(__file__).parent / "golden" / "single_link"
GOLDEN = CASE / "bag"
COMMANDS = f"{NAMESPACE}/joint_commands"


def rewrite(bag: Bag, folder: Path, records: list[Record], **custom: str) -> Path:
    """Write a bag with other records or other custom data (an empty string removes a key)."""
    streams = [stream for name in bag.counts if (stream := find_stream(name))]
    kept = {key: value for key, value in {**bag.custom, **custom}.items() if value}
    with BagWriter(folder, streams, kept) as writer:
        for record in records:
            writer.write(record.name, record.log_time_ns, record.cdr)
    return folder


def test_the_golden_case_is_the_one_that_was_reviewed() -> None:
    case = read_case(CASE)
    for pinned in (case.bag, case.golden):
        bag = open_pinned(pinned)
        assert {name: count for name, count in bag.counts.items() if count} == dict(pinned.counts)
        written = (pinned.path / CHECKSUM_FILE).read_text().split()[0]
        assert written == pinned.sha256[DATA_FILE]


def test_a_replay_says_what_the_nodes_said_over_dds(capsys: pytest.CaptureFixture[str]) -> None:
    code = cli.main(["replay", str(GOLDEN), "--against", str(GOLDEN)])
    assert code == 0, capsys.readouterr().out


def test_twice_gives_byte_identical_files(tmp_path: Path) -> None:
    bag = check_bag(GOLDEN)
    first, second = tmp_path / "first", tmp_path / "elsewhere"
    replayed = replay(bag, first)
    replay(bag, second)
    assert [replayed.counts[name] for name in OUTPUTS] == [200, 200, 200, 201]
    names = sorted(path.name for path in first.iterdir())
    assert names == sorted([DATA_FILE, CHECKSUM_FILE, "metadata.yaml"])
    assert all((first / name).read_bytes() == (second / name).read_bytes() for name in names)


def test_a_divergence_is_named_by_stamp_topic_and_field(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = replay(check_bag(GOLDEN), tmp_path / "replayed")
    records = list(bag.records)
    index = next(i for i, r in enumerate(records) if r.name == COMMANDS and r.log_time_ns == 700_000_000)
    msg: Any = deserialise(records[index].cdr, records[index].type)
    msg.effort[0] += 0.01
    records[index] = replace(records[index], cdr=serialise(msg, records[index].type))
    other = rewrite(bag, tmp_path / "other", records)
    report = tmp_path / "report.json"
    code = cli.main(["replay", str(GOLDEN), "--against", str(other), "--json", str(report)])
    assert code == 1
    assert "0.700000000" in capsys.readouterr().out
    result = json.loads(report.read_text())
    assert result["divergent_messages"] == 1
    first = result["divergences"][0]
    assert (first["stamp_ns"], first["topic"], first["field"]) == (700_000_000, COMMANDS, "effort[0]")


def another_run(bag: Bag, folder: Path, until_ns: int, more: float = 0.0) -> Path:
    """Write a bag as the same motion would give it of another session, ended elsewhere; one torque is off."""
    records = []
    for record in bag.records:
        msg: Any = deserialise(record.cdr, record.type)
        if getattr(msg, "session_token", 0):
            msg.session_token += 5
        if more and record.name == COMMANDS and record.log_time_ns == 700_000_000:
            msg.effort[0] += more
        if record.log_time_ns <= until_ns:
            records.append(replace(record, cdr=serialise(msg, record.type)))
    return rewrite(bag, folder, records)


def test_two_runs_are_compared_without_the_tokens_of_their_sessions_to_the_end_of_both(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """All 899 commands of two equal runs were told by their tokens, and a torque behind one was not."""
    other = another_run(check_bag(GOLDEN), tmp_path / "other", 960_000_000)
    for bag, golden in ((GOLDEN, other), (other, GOLDEN)):
        assert cli.main(["replay", str(bag), "--against", str(golden)]) == 0
        said = " ".join(capsys.readouterr().out.split())
        assert "Two runs are compared, until" in said and "0.035 s before the other" in said
    off = another_run(check_bag(GOLDEN), tmp_path / "off", 960_000_000, more=0.01)
    assert cli.main(["replay", str(GOLDEN), "--against", str(off)]) == 1
    assert "effort[0]" in capsys.readouterr().out


def test_another_law_diverges_from_the_golden_bag(tmp_path: Path) -> None:
    bag = check_bag(GOLDEN)
    settings = json.dumps({"controller": {"law": "lqr"}})
    other = rewrite(bag, tmp_path / "other", list(bag.records), settings=settings)
    assert cli.main(["replay", str(other), "--against", str(GOLDEN)]) == 1


def lose_a_message(bag: Bag, folder: Path) -> Path:
    strain = [r for r in bag.records if r.name.endswith("strain")][50]
    return rewrite(bag, folder, [r for r in bag.records if r is not strain])


def forget_the_configuration(bag: Bag, folder: Path) -> Path:
    return rewrite(bag, folder, list(bag.records), description="")


def garble_the_configuration(bag: Bag, folder: Path) -> Path:
    return rewrite(bag, folder, list(bag.records), description=bag.custom["description"] + "\nnonsense: 1\n")


def garble_the_settings(bag: Bag, folder: Path) -> Path:
    return rewrite(bag, folder, list(bag.records), settings='{"controller": {"horizon": "far"}}')


def write_no_json(bag: Bag, folder: Path) -> Path:
    return rewrite(bag, folder, list(bag.records), settings="{")


def swap_the_preset(bag: Bag, folder: Path) -> Path:
    return rewrite(bag, folder, list(bag.records), preset="light_hub")


def drop_the_model(bag: Bag, folder: Path) -> Path:
    return rewrite(bag, folder, [r for r in bag.records if not r.name.endswith("/model")])


def flip_a_byte(bag: Bag, folder: Path) -> Path:
    shutil.copytree(bag.path, folder)
    data = bytearray((folder / DATA_FILE).read_bytes())
    data[len(data) // 2] ^= 1
    (folder / DATA_FILE).write_bytes(data)
    return folder


UNUSABLE = {
    lose_a_message: "announced 1 strain, the bag has 0",
    forget_the_configuration: "does not say with which description",
    garble_the_configuration: "nonsense",
    garble_the_settings: "horizon: 'far' is not a whole number",
    write_no_json: "settings are not JSON",
    swap_the_preset: "model refused",
    drop_the_model: "no message on /flexarm/model",
    flip_a_byte: "SHA-256 differs",
}


@pytest.mark.parametrize("spoil", UNUSABLE, ids=lambda spoil: spoil.__name__)
def test_a_bag_that_cannot_be_used_ends_with_2_and_one_line(
    spoil: Any, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = spoil(check_bag(GOLDEN), tmp_path / "bag")
    assert cli.main(["replay", str(path)]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert UNUSABLE[spoil] in said.err
    assert len(said.err.splitlines()) == 1


def test_an_existing_output_is_not_overwritten(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="exists already"):
        replay(check_bag(GOLDEN), tmp_path)
