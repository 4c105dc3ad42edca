"""Rows of the fault matrix that concern the controller's node, over DDS in real time."""

from __future__ import annotations

import os
import random
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("flexarm_interfaces", reason="needs ROS and flexarm_interfaces")
from flexarm_interfaces.msg import ControllerStatus, GuardStatus, JointCommand, ModalState  # noqa: E402
from trajectory_msgs.msg import JointTrajectory  # noqa: E402

from flexarm_bringup.installed import find_executable  # noqa: E402
from flexarm_bringup.processes.graph import Process, rig_graph, ros_arguments  # noqa: E402
from flexarm_bringup.processes.running_graph_node import Ear, running  # noqa: E402
from flexarm_bringup.processes.supervisor import Supervisor  # noqa: E402
from flexarm_bringup.tasks.node_settings import arm_graph  # noqa: E402
from flexarm_controller.conversions import reference_to_msg  # noqa: E402
from flexarm_controller.reference import hold  # noqa: E402
from flexarm_model.conversions import stamp_to_ns  # noqa: E402

pytestmark = [pytest.mark.ros, pytest.mark.slow]

T = 0.005  # s
RATE_LIMIT = 2800.0 * T  # N m per period
STOPS = 10
TOPICS = ("controller_status", "guard_status", "applied_effort", "joint_states", "truth", "modal_state")
FAULTY = Path(__file__).parent / "faulty_controller.py"


@contextmanager
def armed(folder: Path, **faulty: str) -> Iterator[tuple[Supervisor, Ear]]:
    """Run the graph, its controller with a fault if there is one, and arm it."""
    extra = {"FAULTY_LOG": str(folder / "commands.txt"), **faulty}

    def command(process: Process) -> list[str]:
        if process.name == "controller" and faulty:
            return [sys.executable, str(FAULTY), *ros_arguments(process)]
        path = find_executable(process.package, process.executable, os.environ)
        return [str(path), *ros_arguments(process)]

    with running(arm_graph("single_link"), TOPICS, folder, extra, command) as (supervisor, ear):
        ear.wait_ready("rig", "guard", "estimator", "controller")
        arm(ear)
        yield supervisor, ear


def arm(ear: Ear) -> None:
    """Arm the guard and wait until the law speaks."""
    ear.heard["controller_status"].clear()
    ear.wait(lambda: bool(ear.call("guard/arm").success), 20.0, "arming")
    ear.wait(lambda: any(is_law(msg) for msg in ear.heard["controller_status"]), 20.0, "the law to take over")


def is_law(msg: Any) -> bool:
    return bool(msg.mode == ControllerStatus.MPC)


def is_armed(msg: Any) -> bool:
    return bool(msg.mode == GuardStatus.ARMED)


def send_to(ear: Ear, angle: float) -> None:
    """Send the arm to an angle at once; it is led there at its velocity limit."""
    if not hasattr(ear, "reference"):
        ear.reference = ear.node.create_publisher(JointTrajectory, "reference", 10)  # type: ignore[attr-defined]
        count = ear.reference.get_subscription_count  # type: ignore[attr-defined]
        ear.wait(lambda: count() >= 2, 20.0, "model and controller")
    now_ns = stamp_to_ns(ear.latest("truth").header.stamp)
    ear.reference.publish(reference_to_msg(hold(np.array([angle])), ("base.rz",), now_ns))  # type: ignore[attr-defined]


def test_a_law_that_hangs_for_three_periods_causes_no_burst_and_is_counted(tmp_path: Path) -> None:
    with armed(tmp_path, FAULTY_EVERY="40", FAULTY_SLEEP=str(3 * T)) as (_, ear):
        first = ear.latest("controller_status")
        ear.wait(lambda: ear.latest("controller_status").overruns >= first.overruns + 10, 60.0, "ten hangs")
        last = ear.latest("controller_status")
        told = ear.heard["controller_status"]
    left = np.loadtxt(tmp_path / "commands.txt")
    assert np.diff(left).min() >= 0.5 * T
    hangs = last.overruns - first.overruns
    assert last.missed_cycles - first.missed_cycles >= hangs
    resting = [msg for msg in told if "the law rests" in msg.reason]
    assert resting and all(msg.mode != ControllerStatus.MPC for msg in resting)
    assert sum(map(is_law, told)) > 0.5 * len(told)


def test_a_law_that_hangs_for_long_is_stopped_by_the_guard_and_stays_so(tmp_path: Path) -> None:
    with armed(tmp_path, FAULTY_EVERY="400", FAULTY_SLEEP="0.5") as (_, ear):
        ear.wait(lambda: ear.latest("guard_status").mode != GuardStatus.ARMED, 20.0, "the guard to notice")
        ear.listen(2.0)
        after = [msg for msg in ear.heard["guard_status"] if msg.reason.startswith("no command for 50 ms")]
        assert ear.latest("guard_status").mode == GuardStatus.STOPPED
        assert after and all(msg.session_token == 0 for msg in after)
        arm(ear)


def has_raised(msg: Any) -> bool:
    return "law raised RuntimeError: on purpose" in str(msg.reason)


def test_a_law_that_raises_is_replaced_in_the_same_cycle(tmp_path: Path) -> None:
    with armed(tmp_path, FAULTY_EVERY="10", FAULTY_RAISES="on purpose") as (_, ear):
        told = ear.heard["controller_status"]
        ear.wait(lambda: sum(map(has_raised, told)) > 20, 30.0, "what is done about it")
        assert ear.latest("guard_status").mode == GuardStatus.ARMED
    raised = list(filter(has_raised, told))
    assert all(msg.mode == ControllerStatus.SHIFTED_PLAN for msg in raised)


@pytest.mark.parametrize("effort", [[float("nan")], [], [0.0, 0.0]], ids=["not finite", "empty", "too long"])
def test_a_command_that_cannot_be_meant_latches_a_stop(effort: list[float], tmp_path: Path) -> None:
    with armed(tmp_path) as (_, ear):
        forger = ear.node.create_publisher(JointCommand, "joint_commands", 10)
        ear.wait(lambda: forger.get_subscription_count() >= 1, 20.0, "the rig")
        token = ear.latest("guard_status").session_token
        msg = JointCommand(sequence=1_000_000, session_token=token, names=["base.rz"], effort=effort)

        def noticed() -> bool:  # only the newest command of a motor period is judged: some are overtaken
            msg.header.stamp = ear.latest("truth").header.stamp
            forger.publish(msg)
            return bool(ear.latest("guard_status").mode != GuardStatus.ARMED)

        ear.wait(noticed, 20.0, "the guard to notice")
        ear.wait(lambda: ear.latest("guard_status").mode == GuardStatus.STOPPED, 20.0, "rest")
        last, efforts = ear.latest("guard_status"), [m.effort[0] for m in ear.heard["applied_effort"]]
    assert last.mode == GuardStatus.STOPPED and last.reason.startswith("command ")
    assert np.isfinite(efforts).all() and abs(np.diff(efforts)).max() <= RATE_LIMIT * (1 + 1e-9)


def test_stops_at_random_instants_of_fast_moves_are_latched_and_brake(tmp_path: Path) -> None:
    rng = random.Random(1)
    with armed(tmp_path) as (_, ear):
        for k in range(STOPS):
            send_to(ear, 0.8 * (-1) ** k)
            ear.listen(rng.uniform(0.1, 0.5))
            assert ear.call("guard/stop").success
            ear.wait(lambda: ear.latest("guard_status").mode != GuardStatus.ARMED, 20.0, "the stop")
            ear.wait(lambda: ear.latest("guard_status").mode == GuardStatus.STOPPED, 15.0, "rest")
            assert ear.latest("guard_status").reason == "stopped by ~/stop"
            arm(ear)
        heard = ear.heard
    stopped = [stamp_to_ns(m.header.stamp) for m in first_of_each_stop(heard["guard_status"])]
    assert len(stopped) == STOPS
    assert max(map(braked_after(heard), stopped)) <= T + 0.010 + 1e-9  # stamps are whole periods


def first_of_each_stop(told: list[Any]) -> list[Any]:
    """Return the first guard_status of every stop."""
    pairs = zip(told[:-1], told[1:], strict=True)
    return [b for a, b in pairs if a.mode == GuardStatus.ARMED and b.mode != GuardStatus.ARMED]


def braked_after(heard: dict[str, list[Any]]) -> Callable[[int], float]:
    """Return what gives the time from a stop until the motor drives no more [s]."""
    velocity = {stamp_to_ns(msg.header.stamp): msg.velocity[0] for msg in heard["joint_states"]}
    effort = {stamp_to_ns(msg.header.stamp): msg.effort[0] for msg in heard["applied_effort"]}

    def after(stop_ns: int) -> float:
        stamps = sorted(stamp for stamp in effort if stamp >= stop_ns and stamp in velocity)
        return next((t - stop_ns) * 1e-9 for t in stamps if effort[t] * velocity[t] <= 1e-9)

    return after


@pytest.mark.parametrize("name", ["estimator", "controller"])
def test_a_node_killed_in_a_move_and_started_again_moves_nothing_before_it_is_armed(
    name: str, tmp_path: Path
) -> None:
    with armed(tmp_path) as (supervisor, ear):
        send_to(ear, 1.0)
        ear.listen(0.2)
        os.kill(supervisor.pids[name], signal.SIGKILL)
        ear.wait(lambda: ear.latest("guard_status").mode != GuardStatus.ARMED, 20.0, "the guard to notice")
        again = tuple(process for process in rig_graph() if process.name == name)
        with Supervisor(again, tmp_path / "again"):
            ear.heard["modal_state"].clear()
            ear.wait_ready(name)
            ear.wait(
                lambda: getattr(ear.latest("modal_state"), "status", None) == ModalState.OK, 30.0, "a state"
            )
            ear.listen(1.0)
            assert ear.latest("guard_status").mode == GuardStatus.STOPPED
            still = [msg.effort[0] for msg in ear.heard["applied_effort"]]
            ear.heard["applied_effort"].clear()
            ear.heard["guard_status"].clear()
            arm(ear)
            ear.listen(0.5)
            ear.wait(
                lambda: any(is_armed(m) for m in ear.heard["guard_status"]), 20.0, "the guard to tell it"
            )
            law = next(msg for msg in ear.heard["controller_status"] if is_law(msg))
            torques = np.array([still[-1], *(msg.effort[0] for msg in ear.heard["applied_effort"])])
    armed_at = next(msg for msg in ear.heard["guard_status"] if is_armed(msg))
    assert stamp_to_ns(law.header.stamp) - stamp_to_ns(armed_at.header.stamp) <= 1_000_000_000
    assert abs(np.diff(torques)).max() <= RATE_LIMIT * (1 + 1e-9)


def test_a_second_controller_of_the_same_name_ends_within_three_seconds(tmp_path: Path) -> None:
    with armed(tmp_path) as (_, ear):
        again = tuple(process for process in rig_graph() if process.name == "controller")
        started = time.monotonic()
        with Supervisor(again, tmp_path / "again") as second:
            second.wait(20.0)
            took = time.monotonic() - started
            assert second.exit_codes() == {"controller": 3}
            assert "node /flexarm/controller runs already" in second.log("controller").read_text("utf8")
        ear.listen(0.5)
        assert ear.latest("guard_status").mode == GuardStatus.ARMED
    assert took <= 3.0 * max(1.0, os.getloadavg()[0] / 2.0)  # 3 s on an idle machine
