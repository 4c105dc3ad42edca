"""Row about bags: what is malformed is refused in a line, before anything is played, and never passes."""

from __future__ import annotations

import contextlib
import hashlib
import io
import shutil
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Protocol

import numpy as np
import yaml

from flexarm_bringup import cli
from flexarm_bringup.bags.bag_writer import CHECKSUM_FILE, DATA_FILE, BagWriter
from flexarm_bringup.bags.cdr import header_stamp_ns
from flexarm_bringup.conversions import serialise
from flexarm_bringup.fault_drill.findings import Finding
from flexarm_bringup.fault_drill.row import Row
from flexarm_bringup.message_class import message_class
from flexarm_bringup.provenance import provenance
from flexarm_bringup.regress.case import EXPECT_FILE
from flexarm_bringup.regress.judge import PASSED, UNUSABLE, judge
from flexarm_bringup.regress.making import Source, make_case
from flexarm_bringup.tasks.task_for import task_for
from flexarm_bringup.topics import NAMESPACE, find_stream
from flexarm_model.conversions import model_to_msg, ns_to_stamp
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

TICKS, PERIOD_NS = 40, 5_000_000  # a fifth of a second at rest
FLIPS, SEED = 100, 48
METADATA = "metadata.yaml"
JOINTS, MODEL = f"{NAMESPACE}/joint_states", f"{NAMESPACE}/model"
BAG_KEY, TOPICS_KEY = "rosbag2_bagfile_information", "topics_with_message_count"


class Named(Protocol):
    """What a row about bags needs of a stand."""

    @property
    def name(self) -> str:
        """Name of the manipulator."""
        ...


def malformed_bags(stand: Named) -> list[Finding]:
    """Spoil the bag of a case in every way, then flip single bytes of it."""
    with TemporaryDirectory() as scratch:
        case = resting_case(stand.name, Path(scratch))
        sound, _ = verdict(case)
        codes, reasons = {}, {}
        for name, spoil in MALFORMED.items():
            spoilt = Path(scratch) / "spoilt"
            shutil.copytree(case, spoilt)
            spoil(spoilt / "bag")
            pin_again(spoilt, case)
            codes[name], reasons[name] = verdict(spoilt)
            shutil.rmtree(spoilt)
        unseen = flipped_unseen(case)
    wrong = [name for name, code in codes.items() if code != UNUSABLE]
    vague = [name for name, reason in reasons.items() if len(reason.splitlines()) != 1]
    count = len(MALFORMED)
    return [
        Finding("exit code of the sound bag", sound, PASSED),
        Finding(_named(f"of {count} malformed bags, exit code other than 2", wrong), len(wrong), 0),
        Finding(_named(f"of {count} malformed bags, reason not in one line", vague), len(vague), 0),
        Finding(f"single flipped bytes that passed, of {FLIPS}", unseen, 0),
    ]


def resting_case(machine: str, folder: Path) -> Path:
    """Make a case of a machine at rest, of a bag with models and encoders alone; return its folder."""
    preset, path = task_for(machine).presets[0], find_manipulator(machine)
    config = load_config(path, preset)
    streams = [stream for name in (MODEL, JOINTS) if (stream := find_stream(name))]
    with BagWriter(folder / "recorded", streams, provenance(machine, path, preset, "{}")) as writer:
        model = serialise(model_to_msg(linearize(ReducedTree(config)), PERIOD_NS), streams[0].type)
        writer.write(MODEL, header_stamp_ns(model), model)
        for k in range(1, TICKS):
            msg = message_class(streams[1].type)()
            msg.header.stamp = ns_to_stamp(k * PERIOD_NS)
            msg.name, msg.position = list(config.actuated), np.array(config.home, float).tolist()
            writer.write(JOINTS, k * PERIOD_NS, serialise(msg, streams[1].type))
    return make_case(folder / "cases" / machine, Source(folder / "recorded")).folder


def pin_again(spoilt: Path, case: Path) -> None:
    """Let the expectations mean every file of a bag as it is now, so that only its content can tell."""
    expect = spoilt / EXPECT_FILE
    content = yaml.safe_load(expect.read_text(encoding="utf8"))
    for name in content["bag"]["sha256"]:
        file, sound = spoilt / "bag" / name, case / "bag" / name
        if file.is_file() and file.read_bytes() != sound.read_bytes():
            content["bag"]["sha256"][name] = hashlib.sha256(file.read_bytes()).hexdigest()
    expect.write_text(yaml.safe_dump(content), encoding="utf8")


def verdict(folder: Path) -> tuple[int, str]:
    """Return exit code of ``flexarm regress`` and what it says on stderr about a case."""
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = cli.main(["regress", str(folder)])
    said = [line for line in err.getvalue().splitlines() if line.startswith("flexarm regress: ")]
    return code, "\n".join(said)


def flipped_unseen(case: Path) -> int:
    """Flip single bits of the bag's files, one at a time; return how many the regression did not tell."""
    rng, unseen = np.random.default_rng(SEED), 0
    for k in range(FLIPS):
        path = case / "bag" / (METADATA if k % 2 else DATA_FILE)
        sound = path.read_bytes()
        data, at = bytearray(sound), int(rng.integers(len(sound)))
        data[at] ^= 1 << int(rng.integers(8))
        path.write_bytes(data)
        unseen += judge(case).code != UNUSABLE
        path.write_bytes(sound)
    return unseen


def _named(text: str, names: list[str]) -> str:
    return f"{text}: {', '.join(names)}" if names else text


def _edit(change: Callable[[dict[str, object]], object]) -> Callable[[Path], None]:
    """Return what changes the metadata of the topic of the encoders."""

    def spoil(bag: Path) -> None:
        """Change what the metadata say of the encoders' topic."""
        path = bag / METADATA
        content = yaml.safe_load(path.read_text(encoding="utf8"))
        (topic,) = (t for t in content[BAG_KEY][TOPICS_KEY] if t["topic_metadata"]["name"] == JOINTS)
        change(topic)
        path.write_text(yaml.safe_dump(content), encoding="utf8")

    return spoil


def _replace(old: bytes, new: bytes) -> Callable[[Path], None]:
    """Return what writes something else of the same length everywhere in the bag."""

    def spoil(bag: Path) -> None:
        """Replace bytes in metadata and data alike."""
        for path in (bag / METADATA, bag / DATA_FILE):
            path.write_bytes(path.read_bytes().replace(old, new))
        (bag / CHECKSUM_FILE).unlink()

    return spoil


def _flip(bag: Path) -> None:
    data = bytearray((bag / DATA_FILE).read_bytes())
    data[len(data) // 2] ^= 1
    (bag / DATA_FILE).write_bytes(data)


def _cut(bag: Path) -> None:
    (bag / DATA_FILE).write_bytes((bag / DATA_FILE).read_bytes()[:-700])
    (bag / CHECKSUM_FILE).unlink()


def _empty(bag: Path) -> None:
    (bag / DATA_FILE).write_bytes(b"")
    (bag / CHECKSUM_FILE).unlink()


def _no_messages(bag: Path) -> None:
    shutil.rmtree(bag)
    streams = [stream for name in (MODEL, JOINTS) if (stream := find_stream(name))]
    BagWriter(bag, streams, {}).close()


def _other_numbers(bag: Path) -> None:
    """Leave a bag that is sound in itself, but not the one that was recorded."""
    expect = bag.parent / EXPECT_FILE
    content = yaml.safe_load(expect.read_text(encoding="utf8"))
    content["bag"]["sha256"][DATA_FILE] = "0" * 64
    expect.write_text(yaml.safe_dump(content), encoding="utf8")


MALFORMED: dict[str, Callable[[Path], object]] = {
    "no bag": shutil.rmtree,
    "no metadata": lambda bag: (bag / METADATA).unlink(),
    "metadata that are no YAML": lambda bag: (bag / METADATA).write_text("a: [1", encoding="utf8"),
    "no data file": lambda bag: (bag / DATA_FILE).unlink(),
    "empty data file": _empty,
    "data file cut short": _cut,
    "a flipped bit": _flip,
    "wrong count in the metadata": _edit(lambda topic: topic.update(message_count=TICKS + 7)),
    "a topic missing": _replace(b"/flexarm/joint_states", b"/flexarm/joint_statez"),
    "another type": _replace(b"sensor_msgs/msg/JointState", b"sensor_msgs/msg/JointStats"),
    "another hash of the type": _edit(
        lambda topic: topic["topic_metadata"].update(type_description_hash="RIHS01_" + "0" * 64)  # type: ignore[attr-defined]
    ),
    "no messages": _no_messages,
    "another recording": _other_numbers,
}  # fmt: skip
ROWS = (Row(48, "a malformed bag", "refused with exit code 2 and a line; never passes", malformed_bags),)
