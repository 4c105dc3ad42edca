"""What the metadata say of a bag as a whole is compared with its messages, as far as rosbag2 promises it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pytest
from bag_fixture import PERIOD_NS, joint_state, modal_state, write_bag
from rosbag2_layout import edit_metadata, qos, write_version
from test_bag_damage import records as joint_records
from test_bag_damage import write_split

from flexarm_bringup import cli
from flexarm_bringup.bags.bag_reader import Record, check_bag
from flexarm_bringup.bags.bag_recovery import recover_bag
from flexarm_bringup.bags.bag_writer import BagError

JOINTS, MODAL, ODOM, MODEL = "/flexarm/joint_states", "/flexarm/modal_state", "/odom", "/flexarm/model"
JOINT_STATE = "sensor_msgs/msg/JointState"
TOPICS = {
    JOINTS: (JOINT_STATE, [qos()]),
    MODAL: ("flexarm_interfaces/msg/ModalState", [qos()]),
    ODOM: (JOINT_STATE, [qos()]),
    MODEL: ("flexarm_interfaces/msg/ReducedModel", [qos("transient_local")]),  # no messages
}
FIRST_NS = 1_700_000_000_000_000_000  # real time; the stamps in the headers begin with 0
LAST_NS = FIRST_NS + 4 * PERIOD_NS
RECORDS = [
    Record(name, TOPICS[name][0], FIRST_NS + k * PERIOD_NS, write(k * PERIOD_NS))
    for k in range(5)
    for name, write in (
        (JOINTS, lambda stamp_ns: joint_state(stamp_ns, 0.5)),
        (MODAL, modal_state),
        (ODOM, lambda stamp_ns: joint_state(stamp_ns, 0.25)),
    )
    if name != ODOM or 0 < k < 4
]
COUNT = len(RECORDS)
SLOW_VERSIONS = [pytest.param(version, marks=pytest.mark.slow) for version in (5, 6, 7, 8)]
STORAGES = ("mcap", "sqlite3")

Edit = Callable[[dict[str, Any]], None]


def written(folder: Path, version: int = 9, storage: str = "sqlite3", *edits: Edit) -> Path:
    """Write a bag and change its metadata."""
    path = write_version(folder, version, storage, TOPICS, RECORDS)
    for edit in edits:
        edit_metadata(path, edit)
    return path


def lose(*names: str) -> Edit:
    def edit(bag: dict[str, Any]) -> None:
        topics = bag["topics_with_message_count"]
        bag["topics_with_message_count"] = [t for t in topics if t["topic_metadata"]["name"] not in names]

    return edit


def total(count: object) -> Edit:
    return lambda bag: bag.update(message_count=count)


def times(start_ns: object = FIRST_NS, duration_ns: object = LAST_NS - FIRST_NS) -> Edit:
    """Return a change of the times of a bag and, where it lists one, of its file."""

    def edit(bag: dict[str, Any]) -> None:
        for item in (bag, *bag.get("files", ())):
            item["starting_time"], item["duration"] = (
                {"nanoseconds_since_epoch": start_ns},
                {"nanoseconds": duration_ns},
            )

    return edit


def of_file(**values: object) -> Edit:
    return lambda bag: bag["files"][0].update(values)


UNNAMED = (
    f"topics_with_message_count: {ODOM} ({JOINT_STATE}) is not among them, the data have 3 messages on it"
)
READ_FIRST = f"the first message was received at {FIRST_NS} ns"
READ_LAST = f"the last message was received at {LAST_NS} ns"
WRONG: dict[str, tuple[Edit, str]] = {
    "a topic lost": (lose(ODOM), UNNAMED),
    "total too low": (total(7), f"message_count: 7, those of its topics are {COUNT}"),
    "total too high": (total(COUNT + 1), f"message_count: {COUNT + 1}, those of its topics are {COUNT}"),
    "no total": (total(0), f"message_count: 0, those of its topics are {COUNT}"),
    "negative duration": (times(duration_ns=-5), f"duration: -5 ns from {FIRST_NS} ns on, {READ_LAST}"),
    "duration too short": (times(duration_ns=1), f"duration: 1 ns from {FIRST_NS} ns on, {READ_LAST}"),
    "start too late": (times(FIRST_NS + 1), f"starting_time: {FIRST_NS + 1} ns, {READ_FIRST}"),
    "times of the headers": (times(0), "was received at"),
}
WRONG_FROM_5: dict[str, tuple[Edit, str]] = {
    "file too low": (
        of_file(message_count=7),
        f"files: message_count: 7, expected those of its topics, {COUNT}",
    ),
    "start too early": (times(FIRST_NS - 1, LAST_NS - FIRST_NS + 1), f"starting_time: {FIRST_NS - 1} ns"),
    "duration too long": (times(duration_ns=LAST_NS), f"duration: {LAST_NS} ns from {FIRST_NS} ns on"),
    "start of the file": (
        of_file(starting_time={"nanoseconds_since_epoch": 5}),
        "files[0]: starting_time: 5 ns, the first",
    ),
    "duration of the file": (of_file(duration={"nanoseconds": 5}), "files[0]: duration: 5 ns from"),
}


@pytest.mark.parametrize("storage", STORAGES)
@pytest.mark.parametrize("version", [4, *SLOW_VERSIONS, 9])
def test_what_contradicts_the_messages_is_refused_in_every_version(
    version: int, storage: str, tmp_path: Path
) -> None:
    """Before, only the counts of single topics were looked at."""
    path = written(tmp_path / "bag", version, storage)
    good = (path / "metadata.yaml").read_text()
    for name, (edit, reason) in {**WRONG, **(WRONG_FROM_5 if version > 4 else {})}.items():
        (path / "metadata.yaml").write_text(good)
        edit_metadata(path, edit)
        with pytest.raises(BagError) as caught:
            check_bag(path)
        assert str(caught.value).startswith(f"{path}: metadata.yaml: "), name
        assert reason in str(caught.value) and len(str(caught.value).splitlines()) == 1, name


def test_a_lost_topic_ends_commands_with_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = written(tmp_path / "bag", 4, "sqlite3", lose(ODOM))
    for words in (["replay", str(path)], ["regress", "--new", str(tmp_path / "case"), "--from", str(path)]):
        assert cli.main(words) == 2
        assert capsys.readouterr().err == f"flexarm {words[0]}: {path}: metadata.yaml: {UNNAMED}\n"


def test_a_topic_lost_together_with_its_count_is_refused(tmp_path: Path) -> None:
    path = written(
        tmp_path / "bag", 9, "mcap", lose(ODOM), total(COUNT - 3), of_file(message_count=COUNT - 3)
    )
    with pytest.raises(BagError, match="/odom .* is not among them, the data have 3 messages on it"):
        check_bag(path)


def test_messages_of_another_type_than_the_metadata_name_are_not_passed_over(tmp_path: Path) -> None:
    def retype(bag: dict[str, Any]) -> None:
        odom = bag["topics_with_message_count"][2]
        odom["topic_metadata"].update(type="sensor_msgs/msg/Imu", type_description_hash="")
        odom["message_count"] = 0

    path = written(tmp_path / "bag", 9, "sqlite3", retype, total(COUNT - 3))
    with pytest.raises(BagError, match=r"/odom \(sensor_msgs/msg/JointState\) is not among them"):
        check_bag(path)


@pytest.mark.parametrize(
    ("edit", "reason"),
    [
        (total("many"), "message_count 'many' is not a whole number"),
        (total(None), "message_count None is not"),
        (times(0.5), r"starting_time or duration 0.5 is not"),
        (times(duration_ns=2.5), "starting_time or duration .* is not"),
        (of_file(message_count=None), r"files\[0\]: message_count None is not"),
        (of_file(duration={"nanoseconds": "long"}), r"files\[0\]: duration 'long' is not"),
        (of_file(duration=None), "metadata are wrong"),
        (lambda bag: bag.update(files=["a.mcap"]), "metadata are wrong"),
    ],
)
def test_totals_that_are_no_numbers_are_refused_with_one_line(
    edit: Edit, reason: str, tmp_path: Path
) -> None:
    with pytest.raises(BagError, match=f"metadata are wrong: .*{reason}|{reason}") as caught:
        check_bag(written(tmp_path / "bag", 9, "mcap", edit))
    assert len(str(caught.value).splitlines()) == 1


DROPPED = of_file(message_count=COUNT + 3), times(FIRST_NS - 7, LAST_NS - FIRST_NS + 20)
RIGHT: dict[str, tuple[int, Sequence[Edit]]] = {
    "messages dropped, or a snapshot": (9, DROPPED),
    "dropped in version 4": (4, DROPPED[1:]),
    "reindexed": (9, [lambda bag: bag.update(files=[]), lose(MODEL)]),  # without its topics without messages
}


@pytest.mark.parametrize("storage", STORAGES)
@pytest.mark.parametrize("name", RIGHT)
def test_what_rosbag2_may_write_is_read(name: str, storage: str, tmp_path: Path) -> None:
    version, edits = RIGHT[name]
    assert list(check_bag(written(tmp_path / "bag", version, storage, *edits)).records) == RECORDS


def test_messages_that_were_dropped_are_no_excuse_for_times_beside_the_others(tmp_path: Path) -> None:
    path = written(tmp_path / "bag", 9, "mcap", of_file(message_count=COUNT + 3), times(FIRST_NS + 1))
    with pytest.raises(BagError, match=READ_FIRST):
        check_bag(path)


def test_a_topic_that_is_left_out_may_hold_the_first_and_the_last_message(tmp_path: Path) -> None:
    kind = JOINT_STATE
    ends = [Record(ODOM, kind, at, joint_state(0, 0.0)) for at in (FIRST_NS - 9, LAST_NS + 9)]
    path = write_version(tmp_path / "bag", 9, "mcap", TOPICS, [ends[0], *RECORDS, ends[1]])

    def of_another_package(bag: dict[str, Any]) -> None:
        bag["topics_with_message_count"][2]["topic_metadata"]["type"] = "lab_msgs/msg/Odometer"

    edit_metadata(path, of_another_package)
    bag = check_bag(path)
    assert (bag.left_out, len(bag.records)) == ((ODOM,), COUNT - 3)


def test_times_of_a_split_bag_may_be_those_of_one_file_but_not_beside_all_messages(tmp_path: Path) -> None:
    whole = joint_records(20)
    path = write_split(tmp_path / "bag", [whole[:10], whole[10:]])
    last_ns = whole[-1].log_time_ns

    def at(start_ns: int, duration_ns: int) -> Edit:
        return lambda bag: bag.update(
            starting_time={"nanoseconds_since_epoch": start_ns}, duration={"nanoseconds": duration_ns}
        )

    for start_ns, duration_ns in ((0, last_ns), (10 * PERIOD_NS, 9 * PERIOD_NS), (0, 18 * PERIOD_NS)):
        edit_metadata(path, at(start_ns, duration_ns))
        assert list(check_bag(path).records) == whole
    for start_ns, duration_ns, key in (
        (last_ns + 1, 5, "starting_time"),
        (-9, 5, "duration"),
        (0, -5, "duration"),
    ):
        edit_metadata(path, at(start_ns, duration_ns))
        with pytest.raises(BagError, match=f"metadata.yaml: {key}: "):
            check_bag(path)
    edit_metadata(path, at(0, last_ns))
    edit_metadata(path, lambda bag: bag["files"][1].update(message_count=3))
    with pytest.raises(BagError, match=r"files: message_count: 10 \+ 3, expected .* 20, or more"):
        check_bag(path)


def test_a_bag_with_wrong_metadata_is_recovered_whole(tmp_path: Path) -> None:
    path = write_bag(tmp_path / "bag")
    edit_metadata(path, total(3))
    with pytest.raises(BagError, match="message_count: 3, those of its topics are 4"):
        check_bag(path)
    assert len(recover_bag(path, tmp_path / "new").bag.records) == 4
