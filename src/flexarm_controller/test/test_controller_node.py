"""The controller node's topics: what it hears of references besides their points."""

import pytest
from lone_node import run_beside

pytestmark = pytest.mark.ros
NODE = """
import sys, time, rclpy
import flexarm_controller.controller_node as module
from flexarm_controller.conversions import reference_to_msg
from flexarm_controller.reference import Reference
from flexarm_interfaces.msg import ControllerStatus, GuardStatus, ModalState
from flexarm_interfaces.srv import CancelMotion, MoveTip
from flexarm_model.conversions import model_to_msg, ns_to_stamp
from flexarm_model.ros.node import LATCHED_QOS, RELIABLE_QOS, TOLD_QOS
from flexarm_model.served.linearize import linearize
from std_msgs.msg import String
from trajectory_msgs.msg import JointTrajectory
import numpy as np

module.secrets.randbelow = lambda most: 41
EPOCH = 10**18
rclpy.init(args=sys.argv)
node = module.ControllerNode()
others = rclpy.create_node("others", namespace="/flexarm")
model = linearize(module.ReducedTree(node._config))
node.take_model(model_to_msg(model))
node.join(GuardStatus(session_token=5))
state = ModalState(model_id=model.model_id, status=ModalState.OK, theta=[0.0], theta_dot=[0.0],
                   disturbance=[0.0], eta=[0.0] * model.n_eta, eta_dot=[0.0] * model.n_eta)
state.header.stamp = ns_to_stamp(EPOCH)
node.exchange.on_modal_state(state)

def motion(points):
    s = np.linspace(0.0, 1.0, points)
    smooth = Reference.through(s, (0.3 * s**2 * (3.0 - 2.0 * s))[:, None])
    return reference_to_msg(smooth, ("base.rz",), EPOCH + 5_000_000)

def send(kind, topic, quality, msg, until, *more):
    publisher = others.create_publisher(kind, f"/flexarm/{topic}", quality)
    end = time.monotonic() + 60.0
    while not publisher.get_subscription_count() and time.monotonic() < end:
        time.sleep(0.01)
    for each in (msg, *more):
        publisher.publish(each)
    time.sleep(0.3 * len(more))  # all have come before one is taken
    while not until() and time.monotonic() < end:
        rclpy.spin_once(node, timeout_sec=0.1)

"""
UNSERVED = """
node.on_reference(motion(11))
leads_to = lambda: float(node.exchange.controller.reference.position(9.0)[0])
print(round(leads_to(), 3))
send(String, "model/models", LATCHED_QOS, String(data=f"{EPOCH + 5_000_000}: refused: no pose"),
     lambda: leads_to() < 0.01)
print(round(leads_to(), 3))
"""
AT_ONCE = """
node.on_reference(motion(11))
node._goals._exchange._models.hear = (heard := []).append
first, second = String(data="1: 3 ab12"), String(data="2: refused: x")
send(String, "model/models", TOLD_QOS, first, lambda: len(heard) == 2, second)
print(*heard)
"""
TOO_LARGE = """
said = []
node._publish = lambda outgoing: said.extend(out.msg.reason for out in outgoing)
send(JointTrajectory, "reference", RELIABLE_QOS, motion(1001), lambda: said)
print(said[-1])
"""
GOAL = """
request = MoveTip.Request()
request.target.position.x, request.target.position.y = 0.64 * np.cos(0.3), 0.64 * np.sin(0.3)
node._goals._exchange.has_models = lambda: {there}  # this node is alone
answers = []
response = node._goals.on_move_tip(request, MoveTip.Response())
getattr(response, "go_by", lambda keep: keep(response))(answers.append)
"""
ANSWERED = """
while not answers:
    rclpy.spin_once(node, timeout_sec=0.1)
print(answers[0].reason or answers[0].goal_id)
"""
DROPPED = """
print(*answers)
{how}
print(answers[0].reason)
time.sleep(0.5)
node._goals._look()  # what was planned comes to nothing
print(node.exchange.controller.reference, len(answers))
"""
CANCELED = DROPPED.format(
    how="print(node._goals.on_cancel(CancelMotion.Request(), CancelMotion.Response()).accepted)"
)
GONE = DROPPED.format(how="node.deactivate()")
ENDING = (
    GOAL.format(there=True)
    + ANSWERED
    + """
said = []
node._goals._publish = lambda outgoing: said.extend((out.topic, out.msg) for out in outgoing)
node.deactivate()
print(*((topic, msg.goal_id, msg.reason) for topic, msg in said))
"""
)
LATE = (
    GOAL.format(there=True)
    + ANSWERED
    + """
from flexarm_interfaces.msg import MotionStatus
from flexarm_model.ros.node import GOALS_QOS
node.deactivate()
heard = []
late = rclpy.create_node("late")
late.create_subscription(MotionStatus, "/flexarm/motion_status", heard.append, GOALS_QOS)
end = time.monotonic() + 20.0
while not any(msg.reason for msg in heard) and time.monotonic() < end:
    rclpy.spin_once(late, timeout_sec=0.1)
print([msg.reason for msg in heard if msg.reason])
"""
)


@pytest.mark.parametrize(
    ("code", "lockstep", "said"),
    [
        (LATE, True, ["1", "['the controller is not active any more']"]),
        (ENDING, True, ["1", "('motion_status', 1, 'the controller is not active any more')"]),
        (UNSERVED, False, ["0.3", "0.0"]),
        (AT_ONCE, False, ["1: 3 ab12 2: refused: x"]),
        (TOO_LARGE, False, ["reference refused: 1001 points, at most 1000 while the guard is armed: "]),
        (GOAL.format(there=True) + ANSWERED, False, ["4100001"]),
        (
            GOAL.format(there=False) + ANSWERED,
            False,
            ["nobody says on model/models that there are models for it"],
        ),
        (GOAL.format(there=False) + ANSWERED, True, ["1"]),
        (
            GOAL.format(there=True) + CANCELED,
            False,
            ["", "True", "canceled while", "None 1"],
        ),
        (GOAL.format(there=True) + GONE, False, ["", "the controller is not", "None 1"]),
    ],
    ids=[
        "what became of a goal for who comes late",
        "end of the controller",
        "without models",
        "words on two references at once",
        "too many points",
        "goals of this life",
        "goal without a model node",
        "goals in lockstep",
        "a goal that is canceled while it is planned",
        "end of the controller while a goal is planned",
    ],
)
def test_what_the_controller_hears_of_references(code: str, lockstep: bool, said: list[str]) -> None:
    lines = run_beside(NODE, code, "--ros-args", "-p", f"lockstep:={str(lockstep).lower()}")
    assert len(lines) == len(said)
    assert all(line.startswith(start) for line, start in zip(lines, said, strict=True)), lines
