"""Forged and old commands find a guard that is blind to one thing, each by the kind that is wrong in it."""

from __future__ import annotations

import os
import sys
from functools import cache, partial
from pathlib import Path
from random import Random
from typing import Any

import pytest

pytest.importorskip("flexarm_interfaces", reason="needs ROS and flexarm_interfaces")

from blind_guard import BLINDFOLDS  # noqa: E402
from flexarm_interfaces.msg import JointCommand, ReducedModel  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402

from flexarm_bringup.fault_drill import forgery_rows  # noqa: E402
from flexarm_bringup.fault_drill.drill import stand_of  # noqa: E402
from flexarm_bringup.fault_drill.findings import Finding  # noqa: E402
from flexarm_bringup.fault_drill.forged import KINDS, RIGHT, Kind, with_token  # noqa: E402
from flexarm_bringup.fault_drill.forger_node import Outcome  # noqa: E402
from flexarm_bringup.fault_drill.stand import Skipped  # noqa: E402
from flexarm_bringup.fault_drill.system_stand import SystemStand  # noqa: E402
from flexarm_bringup.installed import find_executable  # noqa: E402
from flexarm_bringup.processes import running_graph_node  # noqa: E402
from flexarm_bringup.processes.graph import Process, ros_arguments  # noqa: E402
from flexarm_controller.guard import ARMED  # noqa: E402
from flexarm_controller.guard_exchange import GuardExchange  # noqa: E402
from flexarm_controller.guard_settings import GuardSettings, guard_limits  # noqa: E402
from flexarm_model.conversions import ns_to_stamp  # noqa: E402
from flexarm_model.reading.config import load_config  # noqa: E402
from flexarm_model.reading.manipulator_file import find_manipulator  # noqa: E402
from flexarm_model.tree.reduced_tree import ReducedTree  # noqa: E402

BLIND_GUARD = Path(__file__).with_name("blind_guard.py")
EPOCH_NS, PERIOD_NS = 1_700_000_000_000_000_000, 5_000_000
TOKEN, OLD_TOKEN = 7, 6
WARM_UP = 20  # periods
LATE = Kind("with the old token, new stamps and numbers", with_token(OLD_TOKEN), 50)
FOUND_BY = {
    "token": {"guessed token", LATE.name},
    "number": {"number used before", "real ones again"},
    "used stamp": {"stamp used before"},
    "age": {"stamp 20 periods ahead"},
    "model": {"another model"},
    "axes": {"other axes"},
}


@cache
def arm() -> Any:
    config = load_config(find_manipulator("single_link"), "geared")
    tree = ReducedTree(config)
    return config, tree, guard_limits(config, tree, GuardSettings())


@pytest.fixture(autouse=True)
def arm_built_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("flexarm_controller.guard_exchange.ReducedTree", lambda config: arm()[1])
    monkeypatch.setattr("flexarm_controller.guard_exchange.guard_limits", lambda *arguments: arm()[2])


def state(k: int) -> JointState:
    msg = JointState(name=["base.rz"], position=[0.0], velocity=[0.0])
    msg.header.stamp = ns_to_stamp(EPOCH_NS + k * PERIOD_NS)
    return msg


def real_command(k: int, token: int = TOKEN) -> JointCommand:
    msg = JointCommand(session_token=token, sequence=1000 + k, model_id="served", names=["base.rz"])
    msg.effort = [0.1 + 1e-6 * k]
    msg.header.stamp, msg.acts_at = state(k).header.stamp, state(k + 1).header.stamp
    return msg


def armed() -> GuardExchange:
    """Return a guard that has served its model and been armed."""
    config, *_ = arm()
    exchange = GuardExchange(config, GuardSettings(), None)
    exchange.on_drive_states(state(0))
    axes = list(config.actuated)
    served = ReducedModel(config_id=config.config_id, model_id="served", theta_names=axes)
    served.header.stamp = state(0).header.stamp
    exchange.on_model(served)
    exchange.answer()
    assert exchange.guard.arm(exchange.t, TOKEN)
    return exchange


def attacked(kind: Kind) -> Outcome:
    """Let a guard, answering as its node does, hear real commands with forged ones among them."""
    exchange, real, asked, applied, random = armed(), list[Any](), set[float](), 0, Random(1)
    for k in range(1, WARM_UP + 1 + kind.count * kind.every):
        exchange.on_drive_states(state(k))
        is_answered = exchange.is_commanded
        torque = exchange.answer() if is_answered else []
        real.append(real_command(k))
        exchange.on_command(real[-1])
        torque = torque if is_answered else exchange.answer()
        applied += torque[0] in asked
        if k >= WARM_UP and (k - WARM_UP) % kind.every == 0:
            forged = kind.make(real[-WARM_UP:], PERIOD_NS, [28.0], random)
            asked |= {forged.effort[0]} if kind.is_made_up else set()
            exchange.on_command(forged)
    if kind is not RIGHT and not applied:
        assert exchange.guard.mode == ARMED
    return Outcome(kind.count, applied, exchange.guard.refused, 0.0)


def missed() -> set[str]:
    """Return the kinds of commands that were let through or not refused."""
    found = [(kind, attacked(kind)) for kind in (*KINDS, LATE)]
    return {
        kind.name
        for kind, outcome in found
        for finding in forgery_rows.refusals(kind.name, outcome, kind.is_made_up, kind.is_told)
        if not finding.passed
    }


def test_a_sound_guard_refuses_all_kinds_and_lets_through_what_has_nothing_wrong() -> None:
    assert missed() == set()
    assert attacked(RIGHT).applied == RIGHT.count


@pytest.mark.parametrize("blind_to", BLINDFOLDS)
def test_what_a_guard_does_not_see_is_found_by_the_kinds_that_are_wrong_in_it_and_by_no_other(
    blind_to: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    BLINDFOLDS[blind_to](monkeypatch)
    assert missed() == FOUND_BY[blind_to]


@pytest.mark.parametrize("blind_to", ["", "age"])
def test_an_old_command_with_the_new_token_is_found_by_its_age_alone(
    blind_to: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if blind_to:
        BLINDFOLDS[blind_to](monkeypatch)
    exchange = armed()
    exchange.on_drive_states(state(1))
    exchange.on_command(forgery_rows.renewed(real_command(-400, OLD_TOKEN), TOKEN))
    exchange.answer()
    assert exchange.guard.passed == bool(blind_to)


def test_a_part_of_the_row_that_cannot_be_done_is_told_with_its_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def skip(stand: SystemStand) -> list[Finding]:
        raise Skipped("needs root")

    monkeypatch.setattr(forgery_rows, "forgeries", lambda stand: [])
    monkeypatch.setattr(forgery_rows, "from_another_host", skip)
    (told,) = forgery_rows.ROWS[0].play(None)
    assert told.what == "from another host: not done, needs root" and told.bound == "none"


def command(process: Process) -> list[str]:
    """Return the command line of a process; that of the guard is blind."""
    if process.name == "guard":
        return [sys.executable, str(BLIND_GUARD), *ros_arguments(process)]
    return [str(find_executable(process.package, process.executable, os.environ)), *ros_arguments(process)]


@pytest.mark.ros
@pytest.mark.slow
@pytest.mark.parametrize(
    ("play", "kind"), [(forgery_rows.forgeries, "guessed token"), (forgery_rows.replays, LATE.name)]
)
def test_a_guard_node_that_does_not_look_at_tokens_is_found(
    play: Any, kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("BLIND_TO", "token")
    monkeypatch.setattr(running_graph_node, "running", partial(running_graph_node.running, command=command))
    monkeypatch.setattr(forgery_rows, "_without_libraries", lambda stand: [])
    findings = play(SystemStand(stand_of("single_link"), tmp_path))
    assert any(finding.what.startswith(f"{kind}: applied") and not finding.passed for finding in findings)
