"""A case of a recording that was never armed is made, and told to lack the controller's torques."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
pytest.importorskip("rclpy", reason="needs ROS")

from flexarm_bringup import cli  # noqa: E402
from flexarm_bringup.bags.bag_copy import copy_bag  # noqa: E402
from flexarm_bringup.bags.bag_reader import Record, check_bag, decode  # noqa: E402
from flexarm_bringup.bags.bag_types import bag_types  # noqa: E402
from flexarm_bringup.regress.case import read_case  # noqa: E402

GOLDEN = Path(__file__).parent / "golden" / "single_link"


def never_armed(record: Record) -> Record:
    """Return a record, one of the guard as it is while nobody has armed it."""
    if record.name != "/flexarm/guard_status":
        return record
    status = decode(record)
    status.session_token = type(status.session_token)()
    return replace(record, cdr=bytes(bag_types().serialize_cdr(status, record.type)))


@pytest.mark.parametrize("is_armed", [True, False])
def test_a_case_in_which_nothing_was_commanded_says_so(
    is_armed: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = check_bag(GOLDEN / "bag")
    records = bag.records if is_armed else [never_armed(record) for record in bag.records]
    copy_bag(bag, tmp_path / "bag", records)
    new = ("--new", str(tmp_path / "case"), "--from", str(tmp_path / "bag"), "--until", "0.1")
    assert cli.main(["regress", *new]) == 0
    assert ("nothing was commanded" in capsys.readouterr().err) is not is_armed
    assert ("/flexarm/joint_commands" in read_case(tmp_path / "case").golden.counts) is is_armed
