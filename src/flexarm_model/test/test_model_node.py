"""The model node between messages: what it does with the models of a reference that is refused."""

import pytest
from lone_node import run_beside

pytestmark = pytest.mark.ros
START_NS = 10**18
NODE = f"""
import rclpy
from flexarm_model.model_node import ModelNode
from flexarm_model.conversions import ns_to_stamp
from flexarm_interfaces.msg import GuardStatus
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
rclpy.init(args=["--ros-args", "-p", "angle:=0.1"])
node = ModelNode()

def refer():
    msg = JointTrajectory(joint_names=list(node._served.newest.theta_names))
    msg.header.stamp = ns_to_stamp({START_NS})
    msg.points = [JointTrajectoryPoint(positions=[angle]) for angle in (0.0, 1.0)]
    msg.points[1].time_from_start.sec = 1
    node.on_reference(msg)

def tell(verdict):
    node.on_verdict(String(data=f"{START_NS}: {{verdict}}"))

def show():
    pose = node._served.at({START_NS} + 10**10).pose[0]
    print(round(float(pose), 3), node._follows_pose, node._served.count > 2)

"""


@pytest.mark.parametrize(
    ("code", "said"),
    [
        ("refer(); tell('reference accepted: 2 points'); show()", "1.0 False True"),
        ("refer(); tell('reference refused: too fast'); show()", "0.0 True True"),
        ("tell('reference refused: too fast'); refer(); show()", "0.0 True False"),  # it was quicker
    ],
)
def test_models_of_a_refused_reference_are_not_used(code: str, said: str) -> None:
    assert run_beside(NODE, code) == [said]


@pytest.mark.parametrize("text", ["9" * 5000, "-1", "\u00b2", "x", ""])
def test_what_is_no_stamp_changes_nothing(text: str) -> None:
    """Python reads no number of 5000 digits: one message ended the node."""
    code = f"refer(); node.on_verdict(String(data={text!r} + ': reference refused: x')); show()"
    assert run_beside(NODE, code) == ["1.0 False True"]


def test_a_refusal_after_a_stop_leaves_the_models_with_the_measured_pose() -> None:
    stopped = "[node.on_guard_status(GuardStatus(session_token=token)) for token in (7, 0)]"
    code = f"node._follows_pose = False; refer(); {stopped}; tell('reference refused: x'); show()"
    assert run_beside(NODE, code) == ["0.0 True True"]
