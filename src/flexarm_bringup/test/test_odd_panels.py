"""Panels of messages that are not as they should be: left out with the reason, the others are drawn."""

import errno
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag_fixture import joint_state, modal_state
from matplotlib.figure import Figure
from test_bag_plots import PERIOD_NS, make, plot

from flexarm_bringup.bag_plots.panels import PANELS
from flexarm_bringup.bags.bag_types import bag_types
from flexarm_bringup.bags.bag_writer import BagWriter
from flexarm_bringup.topics import STREAMS

TICKS = 5


def empty(kind: str) -> Any:
    """Return a message without content: zeros, empty texts and lists."""
    types, values = bag_types(), {}
    for name, (category, about) in types.fielddefs[kind][1]:
        if category == 1:
            values[name] = {"string": "", "bool": False}.get(about[0], 0)
        elif category == 2:
            values[name] = empty(about)
        else:  # an array of a fixed length, or a sequence
            values[name] = np.zeros(about[1] if category == 3 else 0)
    return types.types[kind](**values)


def of(kind: str, stamp_ns: int, **fields: Any) -> bytes:
    """Return a serialised message with the fields given and nothing else."""
    message = empty(kind)
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, 1_000_000_000)
    for name, value in fields.items():
        setattr(message, name, value)
    return bytes(bag_types().serialize_cdr(message, kind))


def odometry(stamp_ns: int, x: float) -> bytes:
    pose = empty("geometry_msgs/msg/PoseWithCovariance")
    pose.pose.position.x = x
    return of("nav_msgs/msg/Odometry", stamp_ns, pose=pose)


def model(stamp_ns: int) -> bytes:
    """A model of one axis and two modes, which no estimate is of."""
    square, names = np.eye(3).ravel(), {"theta_names": ["base.rz"], "eta_names": ["mode_1", "mode_2"]}
    matrices = dict.fromkeys(("mass", "damping", "stiffness", "phi"), square)
    vectors = {"input": np.ones(3), "bias": np.zeros(3), "q0": np.zeros(3), "zeta": np.zeros(2)}
    kind = "flexarm_interfaces/msg/ReducedModel"
    return of(kind, stamp_ns, model_id="other", pose=np.zeros(1), **names, **matrices, **vectors)


def command(stamp_ns: int) -> bytes:
    return of("flexarm_interfaces/msg/JointCommand", stamp_ns)


def efforts(stamp_ns: int, *values: float) -> bytes:
    return make("sensor_msgs/msg/JointState", stamp_ns, name=["base.rz"], effort=np.array(values))


def states_of(size: int) -> Any:
    """Return a writer of modal states with a covariance of so many numbers."""
    types, kind = bag_types(), "flexarm_interfaces/msg/ModalState"

    def write(stamp_ns: int) -> bytes:
        message = types.deserialize_cdr(modal_state(stamp_ns), kind)
        message.covariance = np.ones(size)
        return bytes(types.serialize_cdr(message, kind))

    return write


NORMAL = {"joint_states": lambda t: joint_state(t, 0.1), "modal_state": modal_state}
# messages, the panel that they concern, what is said of it
ODD: dict[str, tuple[dict[str, Any], str, str]] = {
    "a field is NaN": ({"end_effector": lambda t: odometry(t, np.nan)}, "tip", "drawn"),
    "no torques": ({"applied_effort": efforts}, "torques", "drawn"),
    "no commands": (
        {"applied_effort": lambda t: efforts(t, 1.0), "joint_commands": command}, "torques", "drawn"
    ),
    "no axes": (
        {"joint_states": lambda t: make("sensor_msgs/msg/JointState", t)},
        "joints", "left out: its messages hold nothing to draw",
    ),
    "a reference without points": (
        {"reference": lambda t: make("trajectory_msgs/msg/JointTrajectory", t)}, "joints", "drawn"
    ),
    "a covariance that is no square": ({"modal_state": states_of(8)}, "modes", "drawn"),
    "a covariance too small": ({"modal_state": states_of(1)}, "modes", "drawn"),
    "a model of another arm": (
        {"model": model},
        "energy", "left out: no estimate is of a model that the bag holds",
    ),
    "a matrix too short": (
        {"model": lambda t: make("flexarm_interfaces/msg/ReducedModel", t, theta_names=["base.rz"])},
        "energy", "left out: ValueError: cannot reshape array of size 0 into shape (1,1)",
    ),
}  # fmt: skip


def write(path: Path, messages: dict[str, Any]) -> Path:
    """Write some ticks of messages, made by stamp, into a bag."""
    streams = {stream.topic: stream for stream in STREAMS if stream.topic in messages}
    with BagWriter(path, tuple(streams.values()), {"git": "0" * 40}) as writer:
        for k in range(TICKS):
            for topic, make_message in messages.items():
                writer.write(streams[topic].name, k * PERIOD_NS, make_message(k * PERIOD_NS))
    return path


@pytest.mark.parametrize("name", ODD)
def test_one_odd_topic_costs_one_panel_at_most(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    messages, concerned, became = ODD[name]
    path = write(tmp_path / "bag", {**NORMAL, **messages})
    assert plot(str(path), "--html", str(tmp_path / "page.html")) == 0
    said = {line.split()[0]: line for line in capsys.readouterr().out.splitlines() if line.strip()}
    assert said[concerned].split("  ")[-1].strip() == became
    page = unescape((tmp_path / "page.html").read_text())
    titles = {panel.name: panel.title in page for panel in PANELS}
    assert titles[concerned] == (became == "drawn")
    assert titles["sensors"]  # of the others


def test_a_bag_of_which_nothing_can_be_drawn_ends_with_two_and_the_reason(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = write(tmp_path / "bag", {"joint_states": lambda t: make("sensor_msgs/msg/JointState", t)})
    assert plot(str(path), "--html", str(tmp_path / "page.html")) == 2
    told = f"flexarm plot: {path}: nothing of it can be drawn: joints: its messages hold nothing to draw\n"
    assert capsys.readouterr().err == told
    assert not (tmp_path / "page.html").exists()


def test_a_picture_that_the_disk_refuses_ends_with_two_and_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(plot: Figure, path: Path, **style: object) -> None:
        path.write_bytes(b"\x89PN")
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(Figure, "savefig", refuse)
    path = write(tmp_path / "bag", NORMAL)
    assert plot(str(path), "--png", str(tmp_path / "pictures")) == 2
    told = f"flexarm plot: {tmp_path / 'pictures'}: cannot be written (No space left on device)\n"
    assert capsys.readouterr().err == told
    assert not list((tmp_path / "pictures").iterdir())
