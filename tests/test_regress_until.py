"""A case of the beginning of a bag in which something is missing is refused with what, and when it comes."""

from __future__ import annotations

from pathlib import Path

import pytest

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
pytest.importorskip("rclpy", reason="needs ROS")

from flexarm_bringup import cli  # noqa: E402
from flexarm_bringup.bags.bag_copy import copy_bag  # noqa: E402
from flexarm_bringup.bags.bag_reader import check_bag  # noqa: E402
from flexarm_bringup.replaying import replay_bag  # noqa: E402

GOLDEN = Path(__file__).parent / "golden" / "single_link" / "bag"
JOINTS = "/flexarm/joint_states"


def refused(folder: Path, until: str, capsys: pytest.CaptureFixture[str]) -> str:
    """Return the line that refuses a case of the bag in a folder."""
    new = ("--new", str(folder / "cases" / "short"), "--from", str(folder / "bag"), "--until", until)
    assert cli.main(["regress", *new]) == 2
    assert not (folder / "cases" / "short").exists()
    (line,) = capsys.readouterr().err.splitlines()
    return line.removeprefix("flexarm regress: ")


def test_an_end_before_the_first_measurement_is_told_as_that(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It was said twice that no estimate had come of measurements that there were none of."""
    bag = check_bag(GOLDEN)
    begin_ns = bag.records[0].log_time_ns
    late = [r for r in bag.records if r.name != JOINTS or r.log_time_ns >= begin_ns + 400_000_000]
    copy_bag(bag, tmp_path / "bag", late)
    first = next(r.log_time_ns for r in late if r.name == JOINTS)
    told = (
        f"within the first 0.3 s no message on {JOINTS}; the first comes at {(first - begin_ns) * 1e-9:.3f} s"
    )
    assert refused(tmp_path, "0.3", capsys) == f"{tmp_path / 'bag'}: {told}"


def test_what_nothing_came_of_is_told_once_and_of_the_bag_that_was_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was told of the copy, which is not there any more, and twice."""
    bag = check_bag(GOLDEN)
    copy_bag(bag, tmp_path / "bag", bag.records)
    monkeypatch.setattr(replay_bag, "_write", lambda *_: 0)
    told = "gives no /flexarm/modal_state: no model yet"
    assert refused(tmp_path, "0.3", capsys) == f"{tmp_path / 'bag'}: {told}"
