"""A known type with another definition is refused wherever a bag says so, in metadata or in a data file."""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Callable
from pathlib import Path

import pytest
from bag_fixture import PERIOD_NS, joint_state, write_bag
from rosbag2_layout import edit_metadata, qos, write_version

from flexarm_bringup.bags import bag_definitions
from flexarm_bringup.bags.bag_definitions import definition_hash
from flexarm_bringup.bags.bag_reader import Record, check_bag
from flexarm_bringup.bags.bag_recovery import recover_bag
from flexarm_bringup.bags.bag_types import bag_types
from flexarm_bringup.bags.bag_writer import CHECKSUM_FILE, DATA_FILE, BagError

JOINTS, MODAL = "/flexarm/joint_states", "/flexarm/modal_state"
KIND = "sensor_msgs/msg/JointState"
OURS, _ = bag_types().generate_msgdef(KIND, ros_version=2)
BREAK = "=" * 80 + "\n"


def write(folder: Path, storage: str = "mcap", version: int = 9) -> Path:
    records = [Record(JOINTS, KIND, k * PERIOD_NS, joint_state(k * PERIOD_NS, 0.5)) for k in range(3)]
    return write_version(folder, version, storage, {JOINTS: (KIND, [qos()])}, records)


def forget_hashes(path: Path) -> Path:
    """Leave a bag as of before version 7."""
    edit_metadata(
        path, lambda bag: [topic["topic_metadata"].pop("type_description_hash") for topic in topics(bag)]
    )
    edit_metadata(path, lambda bag: bag.update(version=6))
    return path


def topics(bag: dict[str, list[dict[str, dict[str, str]]]]) -> list[dict[str, dict[str, str]]]:
    return bag["topics_with_message_count"]


def swap(path: Path, old: str, new: str) -> None:
    """Change the text of a definition in the data file, everywhere and to as many bytes."""
    assert len(old) == len(new)
    (data,) = (file for file in path.iterdir() if file.suffix in (".mcap", ".db3"))
    content = data.read_bytes()
    assert old.encode() in content
    data.write_bytes(content.replace(old.encode(), new.encode()))
    (path / CHECKSUM_FILE).unlink(missing_ok=True)


FIELDS = "float64[] position\nfloat64[] velocity\n", "float64[] velocity\nfloat64[] position\n"


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
@pytest.mark.parametrize("has_hash", [False, True])
def test_swapped_fields_in_a_data_file_are_refused(storage: str, has_hash: bool, tmp_path: Path) -> None:
    """Velocities were read as positions where the metadata had no hash."""
    path = write(tmp_path / "bag", storage)
    swap(path, *FIELDS)
    if not has_hash:
        forget_hashes(path)
    with pytest.raises(BagError, match=f"{JOINTS} was recorded with another definition of {KIND}$"):
        check_bag(path)


@pytest.mark.parametrize("storage", ["mcap", "sqlite3"])
def test_a_hash_that_only_the_data_file_tells_is_compared(
    storage: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = forget_hashes(write(tmp_path / "bag", storage))
    if storage == "sqlite3":
        with sqlite3.connect(path / "bag.db3") as base:
            base.execute("UPDATE topics SET type_description_hash = ?", (f"RIHS01_{'0' * 64}",))
        base.close()
    else:  # rosbags writes no hash into MCAP
        monkeypatch.setattr(bag_definitions, "HASH", "offered_qos_profiles")
    with pytest.raises(BagError, match="another definition"):
        check_bag(path)


def test_a_definition_that_nobody_understands_is_refused_by_name(tmp_path: Path) -> None:
    path = write(tmp_path / "bag")
    swap(path, "float64[] velocity", "float64[[ velocity")
    with pytest.raises(BagError) as caught:
        check_bag(path)
    assert str(caught.value) == f"{path}: {JOINTS}: the definition of {KIND} is none (TypesysError)"


def test_a_topic_without_messages_may_have_any_definition(tmp_path: Path) -> None:
    """Recorders note topics of which nothing came, with definitions of their time."""
    path = write_bag(tmp_path / "bag")  # its models have no message
    swap(path, "float64[] f_hz\n", "float32[] f_hz\n")
    assert check_bag(path).counts["/flexarm/model"] == 0
    assert (path / DATA_FILE).is_file()


@pytest.mark.parametrize("has_end", [False, True])
def test_recovery_leaves_out_what_was_recorded_with_another_definition(has_end: bool, tmp_path: Path) -> None:
    """It wrote them anew with today's hash, and nobody would have noticed any more."""
    path = write_bag(tmp_path / "bag", ticks=5)
    swap(path, *FIELDS)
    if not has_end:
        (path / "metadata.yaml").unlink()
        (path / DATA_FILE).write_bytes((path / DATA_FILE).read_bytes()[:-200])
    found = recover_bag(path, tmp_path / "new")
    assert {record.name for record in found.bag.records} == {MODAL}
    assert f"messages of {KIND} are left out: recorded with another definition" in found.doubts


def test_recovery_keeps_what_has_a_damaged_definition(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "bag")
    swap(path, "float64[] velocity", "float64[[ velocity")
    assert {record.name for record in recover_bag(path, tmp_path / "new").bag.records} == {JOINTS, MODAL}


def in_another_order(text: str) -> str:
    first, *others = text.split(BREAK)
    return BREAK.join([first, *reversed(others)])


SAME: dict[str, Callable[[str], str]] = {
    "as it is": str,
    "comments": lambda text: "# joints\n\n" + text.replace("[] position\n", "[] position  # [rad]\n"),
    "spaces": lambda text: re.sub(r"(?m)^(float64\[\]) ", r"  \1\t ", text),
    "constants": lambda text: "uint8 MOST=7\n" + text,
    "order of dependencies": in_another_order,
    "no dependencies": lambda text: text.split(BREAK)[0],
    "long names of types": lambda text: text.replace("std_msgs/Header", "std_msgs/msg/Header"),
    "no last line break": lambda text: text.rstrip(),
}


@pytest.mark.parametrize("name", SAME)
def test_the_same_definition_in_other_words_is_the_same(name: str) -> None:
    assert definition_hash(KIND, SAME[name](OURS)) == bag_types().hash_rihs01(KIND)


OTHER: dict[str, Callable[[str], str]] = {
    "order": lambda text: text.replace(*FIELDS),
    "kind": lambda text: text.replace("float64[] effort", "float32[] effort"),
    "name": lambda text: text.replace("[] effort", "[] torque"),
    "bound": lambda text: text.replace("float64[] effort", "float64[6] effort"),
    "one more": lambda text: "bool is_valid\n" + text,
    "of what it refers to": lambda text: text.replace("int32 sec\n", "uint32 sec\n"),
}


@pytest.mark.parametrize("name", OTHER)
def test_another_definition_is_another(name: str) -> None:
    assert definition_hash(KIND, OTHER[name](OURS)) != bag_types().hash_rihs01(KIND)


@pytest.mark.parametrize("kind", sorted(k for k in bag_types().types if k.startswith("flexarm_interfaces/")))
def test_the_definitions_of_our_own_messages_are_understood(kind: str) -> None:
    text, _ = bag_types().generate_msgdef(kind, ros_version=2)
    assert definition_hash(kind, text) == bag_types().hash_rihs01(kind)
