"""The golden case of silence and jumps holds what it is for, and tells when that is treated otherwise."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

pytestmark = [pytest.mark.ros, pytest.mark.unhurried]
pytest.importorskip("rclpy", reason="needs ROS")

from golden_edits import outputs_of, same_inputs  # noqa: E402
from make_golden_silence import CASE, RECORDED, bad_bag  # noqa: E402

from flexarm_bringup import cli  # noqa: E402
from flexarm_bringup.bags.bag_reader import check_bag  # noqa: E402
from flexarm_controller import exchange as controller_exchange  # noqa: E402
from flexarm_controller.limits import Limits  # noqa: E402
from flexarm_estimator.clock import Clock  # noqa: E402
from flexarm_estimator.judging import (  # noqa: E402
    checks,
    gate,
    own_covariance,
    repeats,
    sensor_record,
    short_term,
)
from flexarm_model.manipulator.description import ManipulatorConfig  # noqa: E402

LARGEST = 1_300_000  # bytes of the whole case


def test_every_trouble_of_the_case_is_seen() -> None:
    said = {
        sensor.reason.partition(" ")[0] for msg in outputs_of(CASE, "modal_state") for sensor in msg.sensors
    }
    assert {"repeats", "jumps", "has", "silent", "far", "leaps", "older"} <= said
    reasons = {msg.reason.partition(":")[0] for msg in outputs_of(CASE, "controller_status")}
    assert {"reference refused", "reference accepted", "estimator"} <= reasons
    active = [name for msg in outputs_of(CASE, "controller_status") for name in msg.limits_active]
    assert active.count("rate:base.rz") > 50


def test_the_case_is_small_and_made_as_its_script_says(tmp_path: Path) -> None:
    assert sum(path.stat().st_size for path in CASE.rglob("*") if path.is_file()) < LARGEST
    assert same_inputs(bad_bag(check_bag(RECORDED), tmp_path / "bag"), check_bag(CASE / "bag"))


def no_jump_ahead(patch: pytest.MonkeyPatch) -> None:
    original = Clock.follow
    patch.setattr(Clock, "follow", lambda self, t, gap, back: original(self, t, math.inf, back))


def twice_the_rate(patch: pytest.MonkeyPatch) -> None:
    original = controller_exchange.limits_of

    def limits_of(config: ManipulatorConfig) -> Limits:
        limits = original(config)
        return replace(limits, effort_rate=2.0 * limits.effort_rate)

    patch.setattr(controller_exchange, "limits_of", limits_of)


CHANGES: dict[str, Callable[[pytest.MonkeyPatch], None]] = {
    "doubt of several sensors at once": lambda patch: patch.setattr(gate, "_TOGETHER", 20),
    "the floor of a covariance": lambda patch: patch.setattr(own_covariance, "_FLOOR", 1e-9),
    "silence": lambda patch: patch.setattr(sensor_record, "_PERIODS", 30.0),
    "a sensor that repeats itself": lambda patch: patch.setattr(repeats, "_PATIENCE", 1000),
    "a clock that jumps": no_jump_ahead,
    "the rate of a torque": twice_the_rate,
    "a late reference": lambda patch: patch.setattr(controller_exchange, "LATE", 20.0),
    "samples that wait": lambda patch: patch.setattr(short_term, "_HELD_MAX", 5),
    "leaps": lambda patch: patch.setattr(short_term, "_FASTER", math.inf),
    "a sample that clips": lambda patch: patch.setattr(checks, "_END", 0.0),
}


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[] if i == 0 else pytest.mark.slow) for i, n in enumerate(CHANGES)]
)
def test_a_change_that_no_sound_run_shows_is_named(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    CHANGES[name](monkeypatch)
    report = tmp_path / "report.json"
    assert cli.main(["regress", str(CASE), "--json", str(report)]) == 1
    (found,) = json.loads(report.read_text())["cases"]
    assert found["first"]["topic"] != "/flexarm/model"
