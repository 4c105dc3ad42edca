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


SPLINE = """
import sys, time
def settle():
    until = time.monotonic() + 20.0
    while not node._flag.is_ready and time.monotonic() < until:
        rclpy.spin_once(node, timeout_sec=0.05)

def load_for_points():
    msg = JointTrajectory(joint_names=list(node._served.newest.theta_names))
    msg.points = [JointTrajectoryPoint(positions=[angle]) for angle in (0.0, 0.02, 0.05, 0.0)]
    for second, point in enumerate(msg.points):
        point.time_from_start.sec = second
    loaded = set(sys.modules)
    node.on_reference(msg)
    print([node._trouble, *sorted(set(sys.modules) - loaded)])

"""


def test_a_node_that_is_ready_loads_nothing_for_its_first_reference() -> None:
    """Loading the spline took longer than the receipt of a reference is waited for."""
    assert run_beside(NODE + SPLINE, "settle(); load_for_points()") == ["['']"]


SOFTENING = f"""
import rclpy, numpy as np
from flexarm_model.model_node import ModelNode
from flexarm_model.conversions import ns_to_stamp
from sensor_msgs.msg import FluidPressure, JointState
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint
settings = ("manipulator:=variable_stiffness", "preset:=''", "angle:=0.1")
rclpy.init(args=["--ros-args", *(part for setting in settings for part in ("-p", setting))])
node = ModelNode()
names = list(node._served.newest.theta_names)

def refer():
    msg = JointTrajectory(joint_names=names)
    msg.header.stamp = ns_to_stamp({START_NS})
    msg.points = [JointTrajectoryPoint(positions=at) for at in ([0.0, 1.57, 0.0], [0.0, 1.0, 0.0])]
    msg.points[1].time_from_start.sec = 1
    node.on_reference(msg)

def measure(after_ns):
    msg = JointState(name=names, position=[0.0, 1.5, 0.0], velocity=[0.0] * 3)
    msg.header.stamp = ns_to_stamp({START_NS} + after_ns)
    node.on_joint_states(msg)

def tell(bar):
    node._watched.hear("pressure", bar * 1e5, 0.0)

def wait(since_ns, until_ns):
    for now_ns in range(since_ns, until_ns, 5_000_000):
        measure(now_ns)

def show(after_ns):
    model = node._served.at({START_NS} + after_ns)
    print(round(float(model.pose[1]), 2), round(float(model.omega[0] / 6.2832), 1))

"""


def test_a_pressure_that_falls_on_the_way_makes_the_models_softer_from_then_on() -> None:
    """The models of the motion stay those of its poses; what was before stays as it was."""
    code = """
refer(); wait(0, 200_000_000); tell(1.2); wait(200_000_000, 1_500_000_000)
for after_ns in (250_000_000, 310_000_000, 2_000_000_000): show(after_ns)
print(node.verdicts()[1].values, node.cache.tree.config.parameters["pressure"])
tell(0.1); print(node.verdicts()[1].text)
"""
    told = run_beside(SOFTENING, code)
    assert told[2].split()[0] == "1.0" and float(told[2].split()[1]) < 7.5
    assert told[3] == "{'pressure': '120000'} 120000.0"
    assert told[4] == "pressure: 10000 is not within 100000 ... 200000 where it is known; 100000 is taken"


def test_a_sensor_of_a_parameter_that_is_silent_or_gone_is_told() -> None:
    """Its one message had come before the node: models were 42 % off, and all was well."""
    code = """
def spin(until):
    end = time.monotonic() + 10.0
    while not until() and time.monotonic() < end:
        rclpy.spin_once(node, timeout_sec=0.05)

def text(): return node.verdicts()[1].text
print(text())
sensor = node.create_publisher(FluidPressure, "parameters/pressure", 10)
spin(lambda: text() != "ok"); print(text())
sensor.publish(FluidPressure(fluid_pressure=1.5e5))
spin(lambda: text() == "ok"); print(text())
node.destroy_publisher(sensor)
spin(lambda: text() != "ok"); print(text())
"""
    told = run_beside("import time\n" + SOFTENING, code)
    topic = "/flexarm/parameters/pressure"
    assert told[0] == told[2] == "ok"
    assert told[1] == f"nothing was heard on {topic} yet; the described value is used"
    assert told[3] == f"nobody publishes {topic} any more; what was told last is used"


def test_a_change_that_comes_before_the_arm_is_heard_or_soon_after_another_is_not_lost() -> None:
    """A driver that tells changes only was left with the stiffness before."""
    code = """
tell(1.5); tell(1.2); wait(0, 20_000_000)
print(node._watched.used)
tell(1.4); measure(25_000_000); print(node._watched.used)
wait(30_000_000, 100_000_000); print(node._watched.used)
tell(1.8); measure(-10 ** 9); print(node._watched.used)  # the clock was set back
"""
    used = [float(line.split()[1].rstrip("}")) for line in run_beside(SOFTENING, code)]
    assert used == [1.2e5, 1.2e5, 1.4e5, 1.8e5]
