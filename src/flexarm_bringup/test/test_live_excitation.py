"""The modal test over DDS: what it tells, when it refuses, that it ends with the guard, and what it finds."""

from __future__ import annotations

import inspect
import json
import os
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flexarm_bringup import cli
from flexarm_bringup.excite.held_arm import HeldArm
from flexarm_bringup.excite.live import TAIL, LiveTest
from flexarm_bringup.excite.live_source import live_graph
from flexarm_bringup.excite.plan import Plan, Wish, plan_excitation
from flexarm_bringup.excite.rig_source import RigTest
from flexarm_bringup.excite.settings import ExciteSettings, wish_of
from flexarm_bringup.excite.told import ToldTest, from_text, to_text
from flexarm_bringup.processes.graph import Process
from flexarm_bringup.processes.supervisor import Supervisor
from flexarm_bringup.sim.rig import RigSettings
from flexarm_model.identification.channel_findings import Finding
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.parameters import ParameterError

PERIOD_NS = 5_000_000
TRIES = 8  # a loaded machine may fall silent by itself
# what stops the arm when the machine gives guard, drives or who excites no time
SILENT = (
    "no command for", "guard did not run", "drives silent", "clock of the drives jumped", "drives let go",
    "the drives have let go",
    "drives have not told for long enough",
)  # fmt: skip


@pytest.fixture(scope="module")
def arm() -> HeldArm:
    return HeldArm(load_config(find_manipulator("single_link"), "geared"))


@pytest.fixture(scope="module")
def plan(arm: HeldArm) -> Plan:
    return plan_excitation(arm, Wish("chirp", (3.0, 40.0), 0.5, 2))


def test_what_is_told_is_read_back_signal_and_all(plan: Plan) -> None:
    found = Finding("root.strain", "1", 1e-6, 1e-6, np.array([2e-4]), np.nan, 1.1, "not moved", "no push")
    back = from_text(to_text(ToldTest(plan, (found,), ("tip_accelerometer",), (12, 34))))
    assert back.plan.excitation.signal == pytest.approx(plan.excitation.signal, abs=1e-15)
    assert back.plan.added(0) == pytest.approx(plan.added(0), abs=1e-12)
    assert (back.plan.effort, back.plan.effort_rate) == (plan.effort, plan.effort_rate) and plan.effort
    assert (back.ignored, back.starts_ns, back.refusal) == (("tip_accelerometer",), (12, 34), "")
    assert np.isnan(back.findings[0].likeness) and back.findings[0].gain == 1.1
    with pytest.raises(ValueError, match="cannot be read"):
        from_text("{}")


def test_what_is_added_belongs_to_the_instant_and_not_to_the_message(arm: HeldArm, plan: Plan) -> None:
    """The quiet stretches add nothing; every third state is missed, the signal keeps its time."""
    live = LiveTest(arm, plan, (), lambda text: None, is_lockstep=True)
    added = [live.answer(k * PERIOD_NS, arm.config.home, np.zeros(1))[1][0] for k in range(400) if k % 3]
    assert not np.any(added)
    live._begin(plan.added(0))
    heard = {k: live.answer(k * PERIOD_NS, arm.config.home, np.zeros(1))[1][0] for k in range(400) if k % 3}
    first = min(heard)
    expected = plan.added(0)[:, 0]
    assert all(heard[k] == expected[k - first] for k in heard)


def test_who_thinks_does_not_keep_who_holds_the_arm_from_the_core(arm: HeldArm, plan: Plan) -> None:
    """Threads of one priority take turns of 100 ms: the verdict on the sensors stopped every test."""
    try:
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(1))  # of this thread; those it begins inherit it
    except PermissionError:
        pytest.skip("this user may not raise priorities")
    try:
        live = LiveTest(arm, plan, (), lambda text: None)
        assert live._pool is not None
        policies = os.sched_getscheduler(0), live._pool.submit(os.sched_getscheduler, 0).result()
        live.close()
    finally:
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
    assert policies == (os.SCHED_RR, os.SCHED_OTHER)


@pytest.mark.filterwarnings("error")  # a mean of nothing was told on the terminal, too
def test_silent_sensors_are_told_and_nothing_is_excited(arm: HeldArm, plan: Plan) -> None:
    live = LiveTest(arm, plan, (), lambda text: None, is_lockstep=True)
    k = 0
    while not live.has_ended and k < 20_000:
        live.on_torque(SimpleNamespace(header=_header(k), name=["base.rz"], effort=[0.0]))
        live.answer(k * PERIOD_NS, arm.config.home, np.zeros(1))
        k += 1
    assert "root_strain.strain is silent" in live.failure
    assert live.told is not None and live.told.starts_ns == () and live.told.refusal == live.failure
    assert k * arm.dt < 2 * arm.settling_time + 10.0 + 5 * TAIL * arm.dt  # nothing but the check


def _header(k: int) -> SimpleNamespace:
    return SimpleNamespace(stamp=SimpleNamespace(sec=0, nanosec=k * PERIOD_NS))


def test_a_band_with_one_end_is_refused() -> None:
    with pytest.raises(ParameterError, match="expected lowest and highest"):
        wish_of(ExciteSettings(band=(3.0,)))


def test_nobody_else_commands_in_the_graph_of_a_modal_test(tmp_path: Path) -> None:
    test = RigTest("single_link", "geared", (0.1,), Wish(share=0.2), RigSettings(mass_scale=1.3), "", ("a",))
    rows = {row.name: row for row in live_graph(test, "clock", tmp_path)}
    assert list(rows) == ["recorder", "model", "guard", "rig", "excite"]
    assert rows["rig"].parameters["mass_scale"] == 1.3 and rows["rig"].parameters["start"] == (0.1,)
    own = rows["excite"].parameters
    assert (own["pose"], own["share"], own["ignore"]) == ((0.1,), 0.2, ("a",))
    assert [row.name for row in live_graph(test, "join", tmp_path)] == ["recorder", "excite"]


@pytest.fixture
def beside_a_controller(ros_environment: dict[str, str], monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """Excite node in a graph where a node "controller" publishes commands."""
    rclpy = pytest.importorskip("rclpy", reason="needs ROS")
    from flexarm_interfaces.msg import JointCommand

    from flexarm_bringup.excite.excite_node import ExciteNode

    for key, value in ros_environment.items():
        monkeypatch.setenv(key, value)
    rclpy.init()
    node, other = ExciteNode(), rclpy.create_node("controller", namespace="flexarm")
    other.create_publisher(JointCommand, "joint_commands", 1)
    yield node
    for each in (node, other):
        each.destroy_node()
    rclpy.try_shutdown()


def spin_to_its_end(node: Any) -> None:
    """Let a node work until it is finished, a minute at most."""
    from rclpy.executors import SingleThreadedExecutor

    executor, end = SingleThreadedExecutor(), time.monotonic() + 60.0
    executor.add_node(node)
    while not node.is_finished and time.monotonic() < end:
        executor.spin_once(timeout_sec=0.05)
    node.stop()


def test_who_is_waited_for_in_vain_is_named() -> None:
    """It was "sensor check", and after a minute "no progress for 60 s: wait for partners"."""
    pytest.importorskip("rclpy", reason="needs ROS")
    from flexarm_bringup.excite.partners_node import Partners
    from flexarm_bringup.series import SeriesError

    said: list[str] = []
    heard: dict[str, Any] = {}
    node: Any = SimpleNamespace(
        get_logger=lambda: SimpleNamespace(info=said.append),
        create_subscription=lambda kind, topic, call, qos: heard.setdefault(topic, call),
    )
    partners = Partners(node, ("model", "guard"), 60.0)
    assert not partners.are_ready(0.1) and not partners.are_ready(59.0)
    heard["model/ready"](SimpleNamespace(data=True))
    assert not partners.are_ready(59.5, "joint_states")
    with pytest.raises(SeriesError, match="no progress for 60 s: waiting for guard/ready$"):
        partners.are_ready(60.1)
    heard["guard/ready"](SimpleNamespace(data=True))
    assert not partners.are_ready(0.0, "joint_states") and partners.are_ready(0.0)
    assert said == [
        "waiting for model/ready, guard/ready",
        "waiting for guard/ready",
        "waiting for joint_states",
    ]


@pytest.mark.ros
def test_a_controller_that_is_active_keeps_the_test_from_beginning(beside_a_controller: Any) -> None:
    spin_to_its_end(beside_a_controller)
    assert "controller may publish joint_commands" in beside_a_controller.outcome
    assert beside_a_controller.exit_code == 1


@pytest.mark.ros
def test_a_commander_whose_name_nobody_heard_keeps_the_test_from_beginning(
    beside_a_controller: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    node = beside_a_controller
    monkeypatch.setattr(node, "_other_commanders", lambda: [])  # its name does not arrive
    node._partners._ready.clear()  # no partner to wait for
    node._now_ns = 0  # the rig was heard
    spin_to_its_end(node)
    assert node.outcome == "somebody without a name may publish joint_commands"


@pytest.mark.ros
def test_a_line_of_who_holds_the_arm_is_not_searched_for(
    beside_a_controller: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first one, "sensor check", took 120 ms right after arming: the guard stopped every other test."""

    def search(*_: object) -> None:
        raise AssertionError("rclpy searches")

    monkeypatch.setattr(inspect, "getframeinfo", search)
    assert beside_a_controller.get_logger().info("told")


@pytest.mark.ros
def test_drives_that_offer_best_effort_are_heard(beside_a_controller: Any) -> None:
    """Nothing of them was: the test waited for joint_states until its patience was over."""
    import rclpy
    from sensor_msgs.msg import Imu, JointState

    from flexarm_model.ros.node import SENSOR_QOS

    drives = rclpy.create_node("lab_driver", namespace="flexarm")
    said = [
        drives.create_publisher(kind, topic, SENSOR_QOS)
        for kind, topic in ((JointState, "joint_states"), (Imu, "imu/tip_accelerometer"))
    ]
    end = time.monotonic() + 20.0
    while time.monotonic() < end and not all(each.get_subscription_count() for each in said):
        time.sleep(0.05)
    assert all(each.get_subscription_count() for each in said)
    heard = {each.topic_name: each.qos_profile.reliability for each in beside_a_controller.subscriptions}
    assert {heard[each.topic_name] for each in said} == {SENSOR_QOS.reliability}  # a node before may be heard
    drives.destroy_node()


@pytest.mark.ros
def test_a_stop_of_the_guard_ends_the_test(tmp_path: Path) -> None:
    """About 5 s, most of it starting up; again where the machine was silent for 50 ms, which stops it."""
    pytest.importorskip("rclpy", reason="needs ROS")
    from flexarm_bringup.processes.running_graph_node import running

    for attempt in range(TRIES):
        rows = live_graph(RigTest("single_link", "geared"), "clock", tmp_path / f"bag{attempt}")
        kept = tuple(_without_recorder(row) for row in rows if row.name != "recorder")
        with running(kept, ("excitation", "guard_status"), tmp_path / str(attempt)) as (supervisor, ear):

            def has_ended(supervisor: Supervisor = supervisor) -> bool:
                return "excite" in supervisor.exit_codes()

            ear.wait(lambda: len(ear.heard["excitation"]) > 40 or has_ended(), 60.0, "the excitation")
            assert ear.call("guard/stop").success
            ear.wait(has_ended, 60.0, "its end")
            assert supervisor.exit_codes()["excite"] == 1
            said = supervisor.log("excite").read_text(encoding="utf8")
        if not any(of_the_machine in said for of_the_machine in SILENT):
            break
        print(f"try {attempt}: the machine was silent before the guard was asked: {said}")
    assert "guard stopped the arm: stopped by ~/stop" in said


def _without_recorder(row: Process) -> Process:
    heard = {"partners": tuple(p for p in row.parameters.get("partners", ()) if p != "recorder")}
    return replace(row, parameters={**row.parameters, **heard} if heard["partners"] else row.parameters)


@pytest.mark.ros
@pytest.mark.slow
@pytest.mark.parametrize("mode", ["lockstep", "clock"])
def test_an_arm_that_is_softer_than_described_is_found_over_dds(mode: str, tmp_path: Path) -> None:
    """5 % softer in frequency; the first mode of free motors within 1 %, the same from the bag alone.

    By the clock the test wants SCHED_RR or a machine that is not overloaded: the guard bears 50 ms of
    silence.
    """
    pytest.importorskip("rclpy", reason="needs ROS")
    arm = ["--manipulator", "single_link", "--preset", "geared"]
    live = ["--perturb", "frequency_scale=0.95", "--resolution", "0.25", "--periods", "2", "--nodes", mode]
    reports = [tmp_path / "live.json", tmp_path / "bag.json"]
    bag = tmp_path / "kept"
    cli.main(["identify", "rig", *arm, *live, "--bag", str(bag), "--json", str(reports[0])])
    cli.main(["identify", str(bag / "bag"), *arm, "--json", str(reports[1])])
    found, again = (json.loads(path.read_text())["tables"][0]["rows"] for path in reports)
    described = HeldArm(load_config(find_manipulator("single_link"), "geared"))
    print(found, abs(described.elastic_poles) / (2 * np.pi))
    assert found[0][1] == pytest.approx(0.95 * abs(described.elastic_poles[0]) / (2 * np.pi), rel=0.01)
    assert [row[1] for row in again] == [row[1] for row in found]
