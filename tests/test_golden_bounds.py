"""The golden case of bounds and bad samples holds what it is for, and tells when that is treated anew."""

from __future__ import annotations

import json
import math
import types
from collections.abc import Callable
from pathlib import Path

import pytest

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
pytest.importorskip("rclpy", reason="needs ROS")

from golden_edits import outputs_of, same_inputs  # noqa: E402
from make_golden_bounds import CASE, RECORDED, bad_bag  # noqa: E402
from planted_changes import PLANTED, _setting  # noqa: E402

from flexarm_bringup import cli  # noqa: E402
from flexarm_bringup.bags.bag_reader import check_bag  # noqa: E402
from flexarm_controller.settings import MpcConfig  # noqa: E402
from flexarm_estimator.messages import sensor_messages  # noqa: E402

LARGEST = 1_000_000  # bytes of the whole case


def test_both_bounds_bind_and_bad_samples_are_refused_and_the_model_changes() -> None:
    active = {
        name.partition(":")[0] for msg in outputs_of(CASE, "controller_status") for name in msg.limits_active
    }
    assert active == {"torque", "strain"}
    states = outputs_of(CASE, "modal_state")
    assert len({msg.model_id for msg in states}) == 2
    reasons = {sensor.reason.partition(" [")[0] for msg in states for sensor in msg.sensors if sensor.reason}
    assert {"not finite", "jumps by itself"} <= reasons


def test_the_case_is_small_and_made_as_its_script_says(tmp_path: Path) -> None:
    assert sum(path.stat().st_size for path in CASE.rglob("*") if path.is_file()) < LARGEST
    assert same_inputs(bad_bag(check_bag(RECORDED), tmp_path / "bag"), check_bag(CASE / "bag"))


def torque_of_no_number(patch: pytest.MonkeyPatch) -> None:
    """Let any torque pass, as if nobody looked whether it is a number."""
    always = types.SimpleNamespace(**{**vars(math), "isfinite": lambda value: True})
    patch.setattr(sensor_messages, "math", always)


CHANGES: dict[str, tuple[Callable[[pytest.MonkeyPatch], None], str]] = {
    "strain margin": (_setting(MpcConfig, strain_margin=0.3), "controller_status"),
    "three iterations": (_setting(MpcConfig, max_iterations=3), "joint_commands"),
    "a NaN that passes": (PLANTED["a NaN that passes"].plant, "modal_state"),
    "a torque that is no number": (torque_of_no_number, "modal_state"),
}


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[] if i == 0 else pytest.mark.slow) for i, n in enumerate(CHANGES)]
)
def test_a_change_that_no_quiet_run_shows_is_named(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    plant, topic = CHANGES[name]
    plant(monkeypatch)
    report = tmp_path / "report.json"
    assert cli.main(["regress", str(CASE), "--json", str(report)]) == 1
    (found,) = json.loads(report.read_text())["cases"]
    assert found["first"]["topic"] == f"/flexarm/{topic}"
