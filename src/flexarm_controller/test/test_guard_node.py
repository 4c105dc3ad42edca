"""The guard node with a clock that is set: what it says and refuses after a standstill or a silence."""

import pytest
from lone_node import run_beside

pytestmark = pytest.mark.ros
NODE = """
import types, rclpy
import flexarm_controller.guard_node as module
from flexarm_interfaces.msg import JointCommand
from flexarm_model.conversions import ns_to_stamp
from sensor_msgs.msg import JointState
clock = [100.0]
module.time = types.SimpleNamespace(monotonic=lambda: clock[0])
rclpy.init()
node = module.GuardNode()
guard, period = node.guard, node.exchange.period_ns

def state(k):
    msg = JointState(name=list(node.exchange.names), position=[0.0], velocity=[0.0])
    msg.header.stamp = ns_to_stamp(10**18 + round(k * period))
    node.on_sensor("drive_states", msg)

def command(k):
    msg = JointCommand(sequence=k, session_token=7, names=node.exchange.names, effort=[0.1])
    msg.header.stamp = ns_to_stamp(10**18 + k * period)
    node.on_command(msg)

"""
STANDSTILL = """
state(0)
guard.arm(node.exchange.t, 7)
for k in (1, 2, 3):
    clock[0] += 1e-9 * period
    state(k)
    if k == 3:
        clock[0] += STOOD
    command(k)
print(guard.passed, guard.mode, guard.reason)
"""


ARM = """
from std_srvs.srv import Trigger
node._margins, node._drives.refusal = "", ""
guard.unready = lambda is_watched=True: ""

def arm():
    answer = node.on_arm(Trigger.Request(), Trigger.Response())
    return answer.success, answer.message

"""
SILENCE = """
state(0)
print(arm())
node.on_stop(Trigger.Request(), Trigger.Response())
clock[0] += 2.0
print(arm(), guard.mode)
"""
RETURN = """
from flexarm_controller.drives.seal import Seal
state(0)
node._drives.seal = Seal("given by the drives of before")
clock[0] += 2.0
node.on_alarm()
state(1)
print(arm())
"""
FAST = """
for k in range(100):
    clock[0] += 0.5e-9 * period
    state(0.5 * k)
print(arm())
"""
LAST_WORDS = """
said = []
publish = node._voice._status.publish
node._voice._status = types.SimpleNamespace(publish=lambda msg: said.append((msg.mode, msg.reason)))
state(0)
guard.arm(node.exchange.t, 7)
node._voice.say()
node.deactivate()
print(*said[-1])
"""

IN_VAIN = """
from flexarm_controller.drives.seal import Seal
sent = []
node._voice._effort.publish = lambda msg: sent.append(guard.reason)
node._drives.seal = Seal("secret")
for k in range(200):
    clock[0] += 1e-9 * period
    msg = JointState(name=list(node.exchange.names), position=[0.0], velocity=[10.0])
    msg.header.stamp = ns_to_stamp(10**18 + k * period)
    node.on_sensor("drive_states", msg)
    node._answer()
    if guard.leaves_drives:
        break
print(guard.mode, len(sent) == k, guard.reason)
"""


@pytest.mark.parametrize(
    ("stood", "said"),
    [(0.0, "3 armed "), (1.0, "2 braking guard did not run for 1000 ms")],
)
def test_a_command_that_waited_while_the_guard_stood_still_is_not_used(stood, said):
    assert run_beside(NODE, STANDSTILL.replace("STOOD", str(stood))) == [said]


def test_nobody_is_told_armed_while_the_drives_are_silent():
    assert run_beside(NODE, ARM + SILENCE) == [
        "(True, 'armed')",
        "(False, 'drives silent for 35 ms') braking",
    ]


def test_drives_that_come_back_have_to_say_whom_they_obey_before_the_guard_is_armed():
    said = "drives or guard were away; the drives have not told yet whom they obey"
    assert run_beside(NODE, ARM + RETURN) == [f"(False, '{said}')"]


def test_the_guard_is_not_armed_with_drives_of_twice_the_rate():
    said = "drives tell every 2.5 ms, the arm's period is 5 ms"
    assert run_beside(NODE, ARM + FAST) == [f'(False, "{said}")']


def test_a_guard_that_is_deactivated_says_that_it_stopped():
    assert run_beside(NODE, LAST_WORDS) == ["2 guard deactivated"]


def test_drives_that_braking_drives_on_hear_no_torque_any_more():
    (said,) = run_beside(NODE, IN_VAIN)
    assert said.startswith("braking True axis 1 (base.rz) is braked and gets no slower")
