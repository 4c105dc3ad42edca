"""Bags that are short, silent or asked to hold another one: told, not guessed at."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from flexarm_bringup import cli
from flexarm_bringup.bags.bag_copy import copy_bag
from flexarm_bringup.bags.bag_reader import Bag, Record, check_bag
from flexarm_bringup.topics import NAMESPACE

GOLDEN = Path(__file__).resolve().parents[3] / "tests" / "golden" / "single_link" / "bag"


@pytest.fixture(scope="module")
def golden() -> Bag:
    return check_bag(GOLDEN)


def part(bag: Bag, folder: Path, is_kept: Callable[[Record], bool]) -> str:
    """Write some messages of a bag into a new one; return its folder."""
    copy_bag(bag, folder, [record for record in bag.records if is_kept(record)])
    return str(folder)


@pytest.mark.parametrize(
    ("command", "length_ns", "said"),
    [
        ("tune", 400_000_000, "s of samples are too short: the first 0.3 s do not count"),  # it is halved
        ("smooth", 200_000_000, "no estimate counts: the first 0.3 s after every start"),
    ],
)
def test_a_bag_in_which_no_filter_settles_is_not_used(
    command: str, length_ns: int, said: str, golden: Bag, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """All of it was judged, and the page said that the first 0.3 s were left out."""
    end = golden.records[0].log_time_ns + length_ns
    path = part(golden, tmp_path / "bag", lambda record: record.log_time_ns < end)
    assert cli.main([command, path]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("command", ["ablate", "smooth"])
def test_why_there_is_no_estimate_is_said(
    command: str, golden: Bag, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model, joints = (
        next(record for record in golden.records if record.name == f"{NAMESPACE}/{topic}")
        for topic in ("model", "joint_states")
    )
    path = part(golden, tmp_path / "bag", lambda record: record in (model, joints))
    assert cli.main([command, path]) == 2
    said = "gives no estimate: its model was taken, but no estimate came of its measurements"
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("line", ["recover {0} --output {0}/new", "replay {0} --output {0}/a/new",
                                  "regress --new {0}/case --from {0}"])  # fmt: skip
def test_nothing_is_written_into_the_bag_that_is_read(
    line: str, golden: Bag, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = Path(part(golden, tmp_path / "bag", lambda record: True))
    before = sorted(path.rglob("*"))
    assert cli.main(line.format(path).split()) == 2
    assert f"lies in the bag {path}, and would be a part of it" in capsys.readouterr().err
    assert sorted(path.rglob("*")) == before


def test_what_is_no_folder_of_a_bag_is_not_said_to_lack_files(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "data.mcap").write_text("")
    for name, said in (("data.mcap", "is a file; expected the folder of a bag"), ("none", "no such folder")):
        assert cli.main(["recover", str(tmp_path / name), "--output", str(tmp_path / "new")]) == 2
        assert f"{name}: {said}" in capsys.readouterr().err


def test_a_topic_cannot_be_fed_as_two(capsys: pytest.CaptureFixture[str]) -> None:
    """The last one won in silence."""
    remaps = ["--remap", "/joint_states:=joint_states", "--remap", "/joint_states:=applied_effort"]
    assert cli.main(["replay", str(GOLDEN), *remaps]) == 2
    assert "/joint_states is fed as 'joint_states' and as 'applied_effort'" in capsys.readouterr().err
