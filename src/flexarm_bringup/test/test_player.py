"""The player hands every record to the side that wants it, in the order of the bag."""

from dataclasses import dataclass, field
from typing import Any

import pytest

from flexarm_bringup.bags.bag_reader import Record
from flexarm_bringup.topics import find_stream

pytestmark = pytest.mark.ros
pytest.importorskip("flexarm_bringup.conversions", reason="needs ROS and flexarm_interfaces")

from flexarm_bringup.conversions import serialise  # noqa: E402
from flexarm_bringup.message_class import message_class  # noqa: E402
from flexarm_bringup.replaying.player import Player  # noqa: E402
from flexarm_model.conversions import ns_to_stamp, stamp_to_ns  # noqa: E402

PERIOD_NS = 5_000_000


@dataclass(frozen=True)
class Sent:
    topic: str
    msg: Any


@dataclass
class Sides:
    """Estimator and controller that only note what they are given."""

    calls: list[str] = field(default_factory=list)

    def on_model(self, msg: Any) -> list[Sent]:
        self.calls.append("model")
        return []

    def on_sensor(self, topic: str, msg: Any) -> None:
        self.calls.append(topic)

    def on_intervention(self, msg: Any) -> None:
        self.calls.append("intervention")

    def step(self, stamp_ns: int) -> list[Sent]:
        self.calls.append(f"step {stamp_ns // PERIOD_NS}")
        state = message_class("flexarm_interfaces/msg/ModalState")()
        state.header.stamp = ns_to_stamp(stamp_ns)
        return [Sent("modal_state", state), Sent("end_effector", message_class("nav_msgs/msg/Odometry")())]

    def on_reference(self, msg: Any) -> list[Sent]:
        self.calls.append("reference")
        return [Sent("controller_status", message_class("flexarm_interfaces/msg/ControllerStatus")())]

    def on_guard_status(self, msg: Any) -> list[Sent]:
        self.calls.append("guard")
        return []

    def on_modal_state(self, msg: Any) -> list[Sent]:
        self.calls.append(f"answer {stamp_to_ns(msg.header.stamp) // PERIOD_NS}")
        return [Sent("joint_commands", message_class("flexarm_interfaces/msg/JointCommand")())]

    def work_ahead(self) -> None:
        self.calls.append("ahead")


def records(*topics: str) -> list[Record]:
    """One record per topic, all of the same instant, "topic@k" for instant k."""
    result = []
    for item in topics:
        topic, _, k = item.partition("@")
        stream = find_stream(topic if topic.startswith("/") else f"/flexarm/{topic}")
        assert stream is not None
        msg = message_class(stream.type)()
        stamp_ns = int(k or 0) * PERIOD_NS
        if stream.is_stamped:
            msg.header.stamp = ns_to_stamp(stamp_ns)
        result.append(Record(stream.name, stream.type, stamp_ns, serialise(msg, stream.type)))
    return result


BAG = (
    "model",
    "reference",
    "joint_states@1",
    "strain@1",
    "imu/tip@1",
    "guard_status@1",
    "tick@1",
    "modal_state@1",
)


def test_in_lockstep_the_tick_makes_the_estimator_act() -> None:
    sides = Sides()
    played = list(Player(sides, sides, lockstep=True).play(records(*BAG)))
    sensors = ["joint_states", "strain", "imu/tip"]
    assert sides.calls == ["model", "model", "reference", *sensors, "guard", "step 1", "answer 1", "ahead"]
    topics = [outgoing.topic for _, outgoing in played]
    assert topics == ["controller_status", "modal_state", "joint_commands", "end_effector"]


def test_in_real_time_the_joint_states_make_the_estimator_act() -> None:
    sides = Sides()
    played = list(
        Player(sides, sides, lockstep=False).play(records("strain@1", "joint_states@1", "joint_states@2"))
    )
    first = ["strain", "joint_states", "step 1", "answer 1", "ahead"]
    assert sides.calls == [*first, "joint_states", "step 2", "answer 2", "ahead"]
    assert [record.log_time_ns // PERIOD_NS for record, _ in played] == [1, 1, 1, 2, 2, 2]


def test_what_the_nodes_once_answered_is_not_fed_back() -> None:
    sides = Sides()
    outputs = ("modal_state", "end_effector", "joint_commands", "controller_status", "truth", "/diagnostics")
    assert list(Player(sides, sides, lockstep=False).play(records(*outputs))) == []
    assert sides.calls == []


def test_an_intervention_acts_in_the_first_step_after_it_or_at_its_stamp_if_it_was_written_late() -> None:
    early, late = "estimator/interventions@9", "estimator/interventions@2"
    for bag, calls in (
        ((early, "joint_states@1"), ["joint_states", "intervention", "step 1"]),
        (
            ("joint_states@1", late, "joint_states@3"),
            ["joint_states", "step 1", "joint_states", "intervention"],
        ),
        (("joint_states@3", late), ["joint_states", "intervention", "step 3"]),
        (("joint_states@1", early), ["joint_states", "step 1"]),
    ):
        sides = Sides()
        list(Player(sides, sides, lockstep=False).play(records(*bag)))
        told = [call for call in sides.calls if not call.startswith(("answer", "ahead"))]
        assert told[: len(calls)] == calls
        assert "intervention" in calls or "intervention" not in told
