"""Policies give every node an enclave of its own with what it uses; only the guard reaches the drives."""

import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import pytest

from flexarm_bringup.cli import main
from flexarm_bringup.processes.graph import DRIVE_TOPICS, Process, rig_graph, with_driver
from flexarm_bringup.security import command
from flexarm_bringup.security.beside_driver import beside_driver
from flexarm_bringup.security.command import _told
from flexarm_bringup.security.policy import NodeAccess, policy
from flexarm_bringup.share import share_path

NODES = (
    "recorder",
    "model",
    "estimator",
    "controller",
    "guard",
    "rig",
    "markers",
    "drift",
    "commander",
    "excite",
)
TOOLS, OPERATOR = ("echo", "monitor", "doctor"), ("call", "arm", "stop", "goto")
COMMANDING = ["controller", "excite"]
STARTING = ("watch", "look")  # of who starts the graph


def test_a_policy_has_one_enclave_per_node_with_its_rights_sorted_and_once() -> None:
    node = NodeAccess("guard", ("/b", "/a", "/b"), ("/c",), (), ("/d",))
    root = ElementTree.fromstring(policy((node,)))
    assert root.attrib == {"version": "0.2.0"}
    (enclave,) = root.findall("enclaves/enclave")
    (profile,) = enclave.findall("profiles/profile")
    assert enclave.get("path") == "/flexarm/guard"
    assert profile.attrib == {"ns": "/flexarm", "node": "guard"}
    assert [group.attrib for group in profile] == [
        {"request": "ALLOW"}, {"publish": "ALLOW"}, {"subscribe": "ALLOW"}
    ]  # fmt: skip
    assert [topic.text for topic in profile.findall("topics[@publish='ALLOW']/topic")] == ["/a", "/b"]


def test_nodes_that_share_an_enclave_have_a_profile_each_in_it() -> None:
    nodes = [NodeAccess(name, (f"/{name}",), (), (), (), "/flexarm/tools") for name in TOOLS]
    root = ElementTree.fromstring(policy([*nodes, NodeAccess("guard", (), ("/c",), (), ())]))
    assert [(item.get("path"), len(item.findall("profiles/profile"))) for item in root.iter("enclave")] == [
        ("/flexarm/tools", 3), ("/flexarm/guard", 1)
    ]  # fmt: skip


def test_what_is_to_be_done_on_the_rig_leaves_no_enclave_without_limits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """sros2 gives a new enclave every right, in the domain of the environment; nothing said so."""
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    nodes = tuple(NodeAccess(name, (), (), (), ()) for name in ("guard", "watch"))
    told = [line.split("#")[0].strip() for line in _told(tmp_path, nodes).splitlines()]
    commands = [line for line in told if line.startswith(("ros2", "export"))]
    store, policies = tmp_path / "keystore", tmp_path / "flexarm.policy.xml"
    assert commands[:2] == ["export ROS_DOMAIN_ID=7", f"ros2 security create_keystore {store}"]
    for enclave in ("/flexarm/guard", "/flexarm/watch"):
        made = commands.index(f"ros2 security create_enclave {store} {enclave}")
        assert commands[made + 1] == f"ros2 security create_permission {store} {enclave} {policies}"
    assert f"export ROS_SECURITY_KEYSTORE=$(realpath {store})" in commands


@pytest.mark.parametrize("topic", DRIVE_TOPICS)
def test_the_policy_of_a_guard_holds_beside_a_driver_on_each_topic(topic: str) -> None:
    """With --driver joint_states the guard would have heard nothing: only the simulated rig was asked."""
    graph = rig_graph()
    asked = [NodeAccess("guard", (), ("/flexarm/drive_states", "/flexarm/stop"), (), ())]
    asked += [NodeAccess("recorder", (), ("/flexarm/drive_states",), (), ())]
    granted = {node.name: node.subscribe for node in beside_driver(asked, graph)}
    (guard,) = (row for row in with_driver(graph, topic) if row.name == "guard")
    assert {f"/flexarm/{guard.remaps.get(each, each)}" for each in ("drive_states", "stop")} <= set(
        granted["guard"]
    )
    assert granted["recorder"] == ("/flexarm/drive_states",)  # it hears what it heard before


class Started(Exception):
    """What would have been started."""


def rows_of(line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Process]:
    """Return the processes that a command would start, by name."""

    def start(rows: Sequence[Process], *given: object, **more: object) -> None:
        raise Started(rows)

    monkeypatch.setattr(command, "Supervisor", start)
    with pytest.raises(Started) as raised:
        main(["security", str(tmp_path / "keys"), *line.split()])
    return {row.name: row for row in raised.value.args[0]}


@pytest.mark.ros
def test_of_a_moves_file_the_nodes_get_the_arm_its_preset_and_its_settings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The file was given to them in place of the arm, and none of them became ready."""
    moves = tmp_path / "my_moves.yaml"
    shutil.copy(share_path("config/moves/single_link.yaml"), moves)
    rows = rows_of(str(moves), tmp_path, monkeypatch)
    assert set(rows) == set(NODES)
    assert {row.parameters["manipulator"] for row in rows.values()} == {"single_link"}
    assert {row.parameters["preset"] for row in rows.values()} == {"geared"}
    assert rows["controller"].parameters["input_jerk"] == 35.0
    rows = rows_of("single_link --preset light_hub", tmp_path, monkeypatch)
    assert {row.parameters["preset"] for row in rows.values()} == {"light_hub"}


@pytest.mark.parametrize(("error", "code"), [(TimeoutError("not ready: rig"), 1), (KeyboardInterrupt(), 130)])
def test_who_learns_nothing_leaves_no_folder(
    error: BaseException, code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def ask(*given: object) -> None:
        raise error

    monkeypatch.setattr(command, "access_of_graph", ask)
    assert main(["security", str(tmp_path / "keys")]) == code
    assert not (tmp_path / "keys").exists()


@pytest.mark.ros
def test_a_node_that_ends_is_named_with_its_last_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    ends = [sys.executable, "-c", "print('no such gauge'); raise SystemExit(2)"]
    monkeypatch.setattr(command, "_command", lambda process: ends)
    assert main(["security", str(tmp_path / "keys")]) == 1
    assert "flexarm security: recorder ended with 2: no such gauge\n" in capfd.readouterr().err
    assert not (tmp_path / "keys").exists()


@pytest.mark.ros
@pytest.mark.slow
def test_the_nodes_themselves_say_what_they_use(tmp_path: Path) -> None:
    assert main(["security", str(tmp_path)]) == 0
    root = ElementTree.parse(tmp_path / "flexarm.policy.xml").getroot()
    assert [item.get("node") for item in root.iter("profile")] == [*NODES, *STARTING, *TOOLS, *OPERATOR]
    enclaves = [*NODES, "watch", "tools", "operator"]
    assert [item.get("path") for item in root.iter("enclave")] == [f"/flexarm/{name}" for name in enclaves]
    assert allowed(root, "topics[@publish='ALLOW']/topic", "/flexarm/applied_effort") == ["guard"]
    assert allowed(root, "services[@request='ALLOW']/service", "/flexarm/rig/attach") == ["guard"]
    assert allowed(root, "topics[@publish='ALLOW']/topic", "/flexarm/joint_commands") == COMMANDING
    assert allowed(root, "topics[@publish='ALLOW']/topic", "/flexarm/strain") == ["rig"]
    assert allowed(root, "services[@reply='ALLOW']/service", "/flexarm/guard/arm") == ["guard"]
    arming = ["commander", "excite", *OPERATOR]
    assert allowed(root, "services[@request='ALLOW']/service", "/flexarm/guard/arm") == arming
    stopping = [*COMMANDING, "watch", *OPERATOR]
    assert allowed(root, "topics[@publish='ALLOW']/topic", "/flexarm/stop") == stopping
    requests = "services[@request='ALLOW']/service"
    for service in ("/flexarm/controller/move_tip", "/flexarm/estimator/reset", "/flexarm/guard/stop"):
        assert set(allowed(root, requests, service)) >= set(OPERATOR)
    for topic in DRIVE_TOPICS:  # on either a driver may speak, as ``--driver`` says, and be looked for
        assert {"guard", "look"} <= set(
            allowed(root, "topics[@subscribe='ALLOW']/topic", f"/flexarm/{topic}")
        )
    for name in TOOLS:  # they hear everything and say nothing but what every node says
        heard = topics(root, name, "subscribe")
        assert heard >= topics(root, "rig", "publish") and "/flexarm/model" in heard
        assert topics(root, name, "publish") == {"/parameter_events", "/rosout"}
    assert {path.name for path in tmp_path.iterdir()} == {
        "flexarm.policy.xml", *(f"{name}.policy.xml" for name in enclaves)
    }  # fmt: skip


def allowed(root: ElementTree.Element, right: str, name: str) -> list[str | None]:
    """Return the nodes with a right."""
    return [
        profile.get("node")
        for profile in root.iter("profile")
        if name in (item.text for item in profile.findall(right))
    ]


def topics(root: ElementTree.Element, name: str, right: str) -> set[str | None]:
    """Return what a node may publish or subscribe to."""
    (profile,) = (item for item in root.iter("profile") if item.get("node") == name)
    return {item.text for item in profile.findall(f"topics[@{right}='ALLOW']/topic")}
