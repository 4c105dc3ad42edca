"""Settings of a case that no node has are refused by name: as defaults they would let it pass for ever."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
pytest.importorskip("rclpy", reason="needs ROS")

from flexarm_bringup import cli  # noqa: E402
from flexarm_bringup.bags.bag_copy import copy_bag  # noqa: E402
from flexarm_bringup.bags.bag_reader import check_bag  # noqa: E402
from flexarm_bringup.regress.case import EXPECT_FILE  # noqa: E402

GOLDEN = Path(__file__).parent / "golden" / "single_link"
WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "a node": ({"controler": {"law": "pd"}}, "controler: no such node; there are model, estimator"),
    "a key": ({"controller": {"law": "pd"}, "estimator": {"gaet": 3}}, "estimator.gaet: unknown; allowed: "),
    "a value": ({"rig": {"seed": "x"}}, "rig.seed: 'x' is not a whole number"),
    "no mapping": ({"estimator": 3}, '--settings: {"estimator": 3}: expected parameters by node'),
}


def refusal(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """Return the one line with which a command ends with 2."""
    capsys.readouterr()
    assert cli.main(["regress", *arguments]) == 2
    (line,) = [s for s in capsys.readouterr().err.splitlines() if s.startswith("flexarm regress: ")]
    return line


@pytest.mark.parametrize("name", WRONG)
def test_a_case_is_not_made_with_settings_of_no_node(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    settings, reason = WRONG[name]
    new = ("--new", str(tmp_path / "case"), "--from", str(GOLDEN / "bag"))
    assert reason in refusal(capsys, *new, "--settings", json.dumps(settings))
    assert not (tmp_path / "case").exists()


def test_a_case_is_not_made_with_a_mark_that_hides_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    new = ("--new", str(tmp_path / "case"), "--from", str(GOLDEN / "bag"))
    assert "markers: 'xfail': is no mark of a case" in refusal(capsys, *new, "--mark", "xfail")
    assert not (tmp_path / "case").exists()


def test_a_case_with_settings_of_no_node_is_not_judged(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    case = Path(shutil.copytree(GOLDEN, tmp_path / "case"))
    content = yaml.safe_load((case / EXPECT_FILE).read_text())
    (case / EXPECT_FILE).write_text(yaml.safe_dump({**content, "settings": WRONG["a key"][0]}))
    assert f"{case / EXPECT_FILE}: settings: {WRONG['a key'][1]}" in refusal(capsys, str(case))


@pytest.mark.parametrize(
    ("settings", "reason"), [('{"estimator": {"gaet": 3}}', "estimator.gaet"), ('{"rig": {"old": 1}}', "")]
)
def test_only_what_is_played_must_be_known_of_a_recording(
    settings: str, reason: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = check_bag(GOLDEN / "bag")
    changed = replace(bag, custom={**bag.custom, "settings": settings})
    path = copy_bag(changed, tmp_path / "bag", [r for r in bag.records if r.log_time_ns < 100_000_000]).path
    new = ("--new", str(tmp_path / "case"), "--from", str(path))
    if reason:
        assert f"its settings: {reason}: unknown" in refusal(capsys, *new)
        own = ("--settings", '{"estimator": {"filter": "corrected"}}')  # over that of the bag
        assert f"its settings: {reason}: unknown" in refusal(capsys, *new, *own)
    else:
        assert cli.main(["regress", *new]) == 0
