"""A guard whose process stood still knows nothing of what happened: nothing that waits for it acts."""

import subprocess
import sys

import pytest

pytestmark = pytest.mark.ros
domain_coordinator = pytest.importorskip("domain_coordinator", reason="needs ROS")
CODE = """
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
    msg.header.stamp = ns_to_stamp(10**18 + k * period)
    node.on_sensor("drive_states", msg)

def command(k):
    msg = JointCommand(sequence=k, session_token=7, names=node.exchange.names, effort=[0.1])
    msg.header.stamp = ns_to_stamp(10**18 + k * period)
    node.on_command(msg)

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


@pytest.mark.parametrize(
    ("stood", "said"),
    [(0.0, "3 armed"), (1.0, "2 braking guard did not run for 1000 ms")],
)
def test_a_command_that_waited_while_the_guard_stood_still_is_not_used(stood, said, monkeypatch):
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    with domain_coordinator.domain_id() as domain:
        monkeypatch.setenv("ROS_DOMAIN_ID", str(domain))
        code = CODE.replace("STOOD", str(stood))
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == said
