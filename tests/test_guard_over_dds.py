"""What the rig does when the controller dies, over DDS in real time."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import numpy as np
import pytest
from flexarm_interfaces.msg import GuardStatus
from running_graph import Ear, running

from flexarm_bringup.graph import Process, rig_graph
from flexarm_model.conversions import stamp_to_ns

pytestmark = pytest.mark.ros

MOVE_DEG = 60.0
PERIOD_NS = 5_000_000
SILENCE_NS = 50_000_000
TRIES = 5  # a loaded machine may fall silent by itself before the test does it
TOPICS = ("joint_states", "joint_commands", "applied_effort", "guard_status", "controller_status", "truth")


def test_killing_the_controller_mid_move_puts_the_rig_into_damping_until_it_is_armed_again(
    tmp_path: Path,
) -> None:
    for attempt in range(TRIES):
        commander = Process(
            "flexarm_bringup", "commander_node", "commander", {"angles": (MOVE_DEG,)}, essential=False
        )
        with running((*rig_graph(), commander), TOPICS, tmp_path / str(attempt)) as (supervisor, ear):
            ear.wait(lambda: _is_mid_move(ear) or "commander" in supervisor.exit_codes(), 60.0, "the move")
            if "commander" in supervisor.exit_codes():
                continue
            os.kill(supervisor.pids["controller"], signal.SIGKILL)
            ear.wait(lambda: ear.latest("guard_status").mode != GuardStatus.ARMED, 5.0, "the guard to notice")
            ear.listen(1.5)
            _assert_braked(ear)
            assert ear.call("guard/arm").success
            return
    pytest.fail(f"the arm never got into its move in {TRIES} tries")


def _is_mid_move(ear: Ear) -> bool:
    truth = ear.latest("truth")
    return (
        truth is not None
        and bool(ear.heard["joint_commands"])  # the controller has been discovered
        and bool(ear.heard["guard_status"])
        and 0.2 < truth.theta[0] < np.radians(MOVE_DEG) - 0.2
        and abs(truth.theta_dot[0]) > 0.5
    )


def _assert_braked(ear: Ear) -> None:
    last_command = max(stamp_to_ns(msg.header.stamp) for msg in ear.heard["joint_commands"])
    braking = next(msg for msg in ear.heard["guard_status"] if msg.mode == GuardStatus.BRAKING)
    assert braking.reason == "no command for 50 ms"
    noticed = stamp_to_ns(braking.header.stamp)
    assert last_command < noticed <= last_command + SILENCE_NS + PERIOD_NS
    assert all(
        msg.session_token == 0
        for msg in ear.heard["guard_status"]
        if stamp_to_ns(msg.header.stamp) >= noticed
    )
    after = [msg for msg in ear.heard["applied_effort"] if stamp_to_ns(msg.header.stamp) >= noticed]
    velocity = {stamp_to_ns(msg.header.stamp): msg.velocity[0] for msg in ear.heard["joint_states"]}
    pairs = [
        (msg.effort[0], velocity[stamp_to_ns(msg.header.stamp)])
        for msg in after
        if stamp_to_ns(msg.header.stamp) in velocity
    ]
    assert len(pairs) > 100
    assert all(effort * rate <= 0.0 for effort, rate in pairs[3:])  # only ever against the motion
    truth = ear.heard["truth"]
    assert abs(truth[-1].theta_dot[0]) < 0.05
    assert abs(truth[-1].theta[0] - truth[-20].theta[0]) < 1e-2
