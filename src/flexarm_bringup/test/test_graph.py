"""One table of processes, the same for the launch file and the supervisor."""

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest
import yaml

from flexarm_bringup.processes.composition import composed
from flexarm_bringup.processes.graph import (
    Process,
    rig_graph,
    ros_arguments,
    with_drift,
    with_driver,
    with_markers,
)
from flexarm_bringup.processes.supervisor import RESPAWNS, WITHIN
from flexarm_bringup.processes.timing import PRIORITIES, timing
from flexarm_bringup.tasks.node_settings import arm_graph
from flexarm_model.process.kept import MARK as KEPT
from flexarm_model.process.security import SecurityError
from flexarm_model.ros.parameter_file import read_parameter_file

STOPPER = "flexarm_bringup.processes.stopper_node"
SECOND = "flexarm_bringup.processes.second_driver_node"
LAUNCH_FILE = Path(__file__).parents[1] / "launch" / "rig.launch.py"


def test_every_node_gets_the_same_manipulator_and_mode_of_time() -> None:
    graph = rig_graph("mine.yaml", "heavy", lockstep=True, bag="/data/run", settings={"rig": {"seed": 7}})
    names = ["recorder", "model", "estimator", "controller", "guard", "rig"]
    assert [process.name for process in graph] == names
    for process in graph:
        shared = {key: process.parameters[key] for key in ("manipulator", "preset", "lockstep")}
        assert shared == {"manipulator": "mine.yaml", "preset": "heavy", "lockstep": True}
    assert graph[-1].parameters["seed"] == 7
    assert graph[0].parameters["bag"] == "/data/run"


def test_by_the_clock_guard_and_rig_have_other_cores_than_estimator_and_controller() -> None:
    cores = {name: timing(name, range(5)).get("cores") for name in PRIORITIES}
    assert cores == {"guard": [0, 1], "rig": [0, 1], "estimator": [2, 3, 4], "controller": [2, 3, 4]}
    assert timing("guard", [3]) == {"realtime_priority": 70}
    for process in rig_graph():
        given = {
            key: process.parameters[key]
            for key in ("realtime_priority", "cores")
            if key in process.parameters
        }
        assert given == (timing(process.name) if process.name in PRIORITIES else {})
    assert not any(
        {"cores", "realtime_priority"} & set(process.parameters) for process in rig_graph(lockstep=True)
    )
    mine = rig_graph(settings={"guard": {"cores": [7]}})
    assert mine[3].parameters["cores"] == [7]


def test_a_recorder_that_ends_does_not_end_the_run() -> None:
    assert [process.name for process in rig_graph(bag="/data/run") if not process.essential] == ["recorder"]


def test_a_viewer_s_node_shows_the_same_arm_and_does_not_end_the_run() -> None:
    *rest, shown = with_markers(rig_graph("planar_3rrr", "geared", bag="b"))
    assert tuple(rest) == rig_graph("planar_3rrr", "geared", bag="b")
    assert shown.name == "markers" and not shown.essential
    assert shown.parameters == {"manipulator": "planar_3rrr", "preset": "geared", "lockstep": False}


def test_a_watch_for_drift_only_listens() -> None:
    *rest, watch = with_drift(rig_graph("planar_3rrr", "geared", lockstep=True), {"learning": 5.0})
    assert tuple(rest) == rig_graph("planar_3rrr", "geared", lockstep=True)
    assert watch.name == "drift" and not watch.essential
    assert watch.parameters == {"manipulator": "planar_3rrr", "preset": "geared", "learning": 5.0}


def test_a_viewer_goes_with_a_watch_for_drift() -> None:
    graph = with_markers(with_drift(rig_graph("planar_3rrr", "geared")))
    assert [process.name for process in graph[-2:]] == ["drift", "markers"]
    assert graph[-1].parameters == {"manipulator": "planar_3rrr", "preset": "geared", "lockstep": False}


@pytest.mark.parametrize(
    ("topic", "remaps"), [("drive_states", {}), ("joint_states", {"drive_states": "joint_states"})]
)
def test_a_driver_takes_the_place_of_the_simulated_rig(topic: str, remaps: dict[str, str]) -> None:
    graph = rig_graph(bag="b")
    driven = with_driver(graph, topic)
    assert [row.name for row in driven] == [row.name for row in graph if row.name != "rig"]
    assert {row.name: row.remaps for row in driven if row.remaps} == ({"guard": remaps} if remaps else {})
    assert [row.parameters for row in driven] == [row.parameters for row in graph if row.name != "rig"]


def test_a_driver_tells_on_a_topic_that_is_one_and_by_the_clock() -> None:
    with pytest.raises(ValueError, match="driver: 'true': expected drive_states or joint_states"):
        with_driver(rig_graph(), "true")
    with pytest.raises(ValueError, match="a real rig runs by the clock, not in lockstep"):
        with_driver(rig_graph(lockstep=True))


def test_settings_of_an_unknown_node_are_refused() -> None:
    with pytest.raises(ValueError, match="settings for rigg: no such node; there are model, estimator"):
        rig_graph(settings={"rigg": {"seed": 1}})


@pytest.mark.parametrize(
    "value", [True, 3, 1.5, 2.0, 1e-7, -1e300, "true", "3", "a: b", "", "Ü", [1.0, 1e-9], ["a", "1"], [True]]
)
def test_parameters_keep_their_type_on_the_command_line(value: Any) -> None:
    arguments = ros_arguments(Process("p", "e", "n", {"key": value}, {"a": "b"}))
    assert arguments[:5] == ["--ros-args", "-r", "__node:=n", "-r", "a:=b"]
    read = yaml.safe_load(arguments[6].removeprefix("key:="))
    assert read == value
    assert type(read) is type(value)


def plain(parameters: Any) -> dict[str, Any]:
    """Return parameters with lists for tuples, as a file has them."""
    return {key: list(value) if isinstance(value, tuple) else value for key, value in parameters.items()}


class Recorded(SimpleNamespace):
    """Stands for a class of ``launch``: keeps what it was made with."""

    def __init__(self, *arguments: Any, **named: Any) -> None:
        super().__init__(arguments=arguments, **named)

    def perform(self, context: SimpleNamespace) -> str:
        return str(context.launch_configurations[self.arguments[0]])


def fake_launch(monkeypatch: pytest.MonkeyPatch) -> None:
    """``launch`` is not on PyPI: what the file asks of it is recorded instead."""
    names = {
        "launch": ["LaunchDescription"],
        "launch.actions": ["DeclareLaunchArgument", "LogInfo", "OpaqueFunction", "SetEnvironmentVariable"],
        "launch.substitutions": ["EnvironmentVariable", "LaunchConfiguration"],
        "launch_ros": [],
        "launch_ros.actions": ["Node"],
        STOPPER: [],
        SECOND: [],
    }
    for module, classes in names.items():
        fake = ModuleType(module)
        for name in classes:
            setattr(fake, name, type(name, (Recorded,), {}))
        monkeypatch.setitem(sys.modules, module, fake)
    sys.modules[STOPPER].StopperNode = Stopped  # type: ignore[attr-defined]
    sys.modules[SECOND].refuse_second_driver = lambda graph: None  # type: ignore[attr-defined]


class Stopped:
    """Stands for the node that stops the motion: counts how often it does."""

    count = 0

    def stop(self) -> None:
        Stopped.count += 1


def launched(monkeypatch: pytest.MonkeyPatch, **given: str) -> list[Any]:
    fake_launch(monkeypatch)
    scope: dict[str, Any] = {}
    exec(compile(LAUNCH_FILE.read_text(), LAUNCH_FILE, "exec"), scope)
    actions = scope["generate_launch_description"]().arguments[0]
    declared = {item.arguments[0]: item.default_value for item in actions if hasattr(item, "default_value")}
    assert declared == {
        "manipulator": "single_link", "preset": "", "lockstep": "false", "bag": "", "composed": "false",
        "driver": "", "markers": "false", "drift": "false", "respawn": "true",
    }  # fmt: skip
    return list(actions[-1].function(SimpleNamespace(launch_configurations={**declared, **given})))


def ended(node: Any, code: int, is_shutdown: bool = False) -> None:
    """Let a launched node end; what launch is given then it would go through, so it must be nothing."""
    event = SimpleNamespace(returncode=code)
    context = SimpleNamespace(is_shutdown=is_shutdown, locals=SimpleNamespace(event=event))
    assert node.on_exit.function(context) is None


def ends_all(node: Any, code: int = -9) -> bool:
    """Whether launch ends with an error when this node does."""
    with pytest.raises(RuntimeError, match=f"{node.name} ended with {code}"):
        ended(node, code)
    return True


def test_the_launch_file_names_a_folder_for_what_nodes_keep_over_a_crash(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    fake_launch(monkeypatch)
    scope: dict[str, Any] = {}
    exec(compile(LAUNCH_FILE.read_text(), LAUNCH_FILE, "exec"), scope)
    actions = scope["generate_launch_description"]().arguments[0]
    (folder,) = (item.arguments[1] for item in actions if item.arguments[:1] == (KEPT,))
    assert list(Path(folder).iterdir()) == []


def test_the_launch_file_starts_the_same_graph(monkeypatch: pytest.MonkeyPatch) -> None:
    nodes = launched(monkeypatch, bag="/data/run", lockstep="true")
    graph = arm_graph("single_link", bag="/data/run", lockstep=True)
    assert [(node.package, node.executable, node.name) for node in nodes] == [
        (process.package, process.executable, process.name) for process in graph
    ]
    assert [node.parameters[0] for node in nodes] == [process.parameters for process in graph]
    assert [node.on_exit is None for node in nodes] == [not process.essential for process in graph]
    assert not any(node.respawn for node in nodes)
    assert all(ends_all(node) for node in nodes if node.on_exit)


def test_the_launch_file_leaves_the_simulated_rig_out_for_a_driver(monkeypatch: pytest.MonkeyPatch) -> None:
    nodes = launched(monkeypatch, driver="joint_states")
    graph = with_driver(arm_graph("single_link"), "joint_states")
    assert [node.name for node in nodes] == [row.name for row in graph]
    (guard,) = (node for node in nodes if node.name == "guard")
    assert guard.remappings == [("drive_states", "joint_states")]


def test_parameters_as_launch_ros_writes_them_are_read(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """By the clock there are lists (``cores``), which launch_ros 0.26.6 writes as tuples of Python."""
    monkeypatch.setattr("os.sched_getaffinity", lambda pid: {0, 1})
    is_tagged = False
    for node in launched(monkeypatch, manipulator="spatial_3tpt"):
        given = {
            key: tuple(value) if isinstance(value, list | tuple) else value
            for key, value in node.parameters[0].items()
        }
        path = tmp_path / f"{node.name}.yaml"
        path.write_text(yaml.dump({"/**": {"ros__parameters": given}}), encoding="utf8")
        is_tagged |= "!!python/tuple" in path.read_text(encoding="utf8")
        assert set(read_parameter_file(path).keys_for(f"/flexarm/{node.name}")) == set(given)
    assert is_tagged


def test_launched_with_security_that_cannot_be_had_nothing_is_started(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("ROS_SECURITY_ENABLE", "true")
    monkeypatch.delenv("ROS_SECURITY_STRATEGY", raising=False)
    with pytest.raises(SecurityError, match="ROS_SECURITY_STRATEGY: ''"):
        launched(monkeypatch)
    monkeypatch.setenv("ROS_SECURITY_STRATEGY", "Enforce")
    monkeypatch.setenv("ROS_SECURITY_KEYSTORE", str(tmp_path))
    with pytest.raises(SecurityError, match="create_enclave .* /flexarm/watch"):
        launched(monkeypatch)


def test_the_launch_file_shows_the_arm_when_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    nodes = launched(monkeypatch, markers="true")
    assert [node.name for node in nodes] == [process.name for process in with_markers(rig_graph())]
    assert nodes[-1].on_exit is None and nodes[-1].respawn
    assert nodes[-1].respawn_max_retries == RESPAWNS  # nobody else counts


def test_the_launch_file_takes_every_word_for_yes_and_no_and_refuses_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    nodes = launched(monkeypatch, markers="1", drift="on", respawn="No")
    assert [node.name for node in nodes[-2:]] == ["markers", "drift"]
    assert not any(node.respawn for node in nodes)
    with pytest.raises(ValueError, match="composed:=si: expected true or false"):
        launched(monkeypatch, composed="si")


def test_the_launch_file_refuses_a_misspelt_argument_and_names_one_that_is_none_of_its_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """``ros2 launch`` takes any: ``prest:=light_hub`` ran another arm than was meant, without a word."""
    with pytest.raises(ValueError, match="prest:=light_hub: no such argument; expected preset?"):
        launched(monkeypatch, prest="light_hub")
    with pytest.raises(ValueError, match="drivr:=drive_states: no such argument; expected driver?"):
        launched(monkeypatch, drivr="drive_states")
    said, *nodes = launched(monkeypatch, camera_driver="uvc")  # perhaps of a launch file that includes this
    assert said.msg.startswith("camera_driver:=uvc: no argument of the rig") and "drift" in said.msg
    assert [node.name for node in nodes] == [node.name for node in launched(monkeypatch)]


def test_the_launch_file_watches_for_drift_when_asked_with_the_settings_of_the_arm(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    nodes = launched(monkeypatch, manipulator="spatial_3tpt", preset="sim", drift="true")
    assert (nodes[-1].name, nodes[-1].executable, nodes[-1].on_exit) == ("drift", "drift_node", None)
    assert nodes[-1].parameters == [{"manipulator": "spatial_3tpt", "preset": "sim", "learning": 8.0}]


def test_the_launch_file_puts_estimator_and_controller_into_one_process_when_asked(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    at_the_end: list[Callable[[], Any]] = []
    monkeypatch.setattr("atexit.register", lambda *given, **more: at_the_end.append(partial(*given, **more)))
    nodes = launched(monkeypatch, composed="true", markers="true")
    row = next(row for row in composed(arm_graph("single_link")) if row.members)
    both = next(node for node in nodes if node.executable == row.executable)
    assert not hasattr(both, "name") and both.exec_name == "composed"  # a name would be that of both
    written = yaml.safe_load(Path(both.parameters[0]).read_text(encoding="utf8"))
    assert written["/flexarm/controller"]["ros__parameters"] == plain(row.members[1].parameters)
    before = Stopped.count
    ended(both, -9)
    assert Stopped.count == before + 1 and both.respawn
    assert any(tmp_path.glob("flexarm_launch_*"))  # a node that comes back reads it again
    for end in at_the_end:
        end()
    assert not any(tmp_path.glob("flexarm_launch_*"))
    with pytest.raises(ValueError, match="not in lockstep"):
        launched(monkeypatch, composed="true", lockstep="true")


def test_launched_by_the_clock_a_node_comes_back_and_the_motion_is_stopped(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    nodes = launched(monkeypatch, bag="/data/run")
    assert [node.name for node in nodes if not node.respawn] == ["recorder"]
    before = Stopped.count
    ended(nodes[1], -9)
    ended(nodes[1], -9, is_shutdown=True)
    assert Stopped.count == before + 1
    nodes = launched(monkeypatch, respawn="false")
    assert all(ends_all(node) and not node.respawn for node in nodes)
    ended(nodes[1], -2, is_shutdown=True)


@pytest.mark.parametrize("code", [0, 2, 3])  # asked to end, wrong configuration, name taken
def test_launched_a_node_that_would_end_again_ends_all(code: int, monkeypatch: pytest.MonkeyPatch) -> None:
    nodes = launched(monkeypatch)
    assert all(ends_all(node, code) and node.respawn_delay > 0.0 for node in nodes)


def test_launched_a_node_that_crashes_too_often_ends_all(monkeypatch: pytest.MonkeyPatch) -> None:
    node = launched(monkeypatch)[1]
    assert node.respawn_max_retries == -1  # launch would count them over its whole life
    for _ in range(RESPAWNS):
        ended(node, -11)
    assert ends_all(node, -11)


def test_launched_a_node_that_crashes_now_and_then_comes_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """The fourth crash ended all, weeks after the first."""
    node, now = launched(monkeypatch)[1], [0.0]
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    for _ in range(5 * RESPAWNS):
        now[0] += WITHIN / RESPAWNS + 1.0
        ended(node, -11)
