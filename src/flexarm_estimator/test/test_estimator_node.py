"""The estimator as a process: what it publishes in lockstep, what it refuses, how it ends."""

import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from planar_strip import single_link

pytestmark = pytest.mark.ros
rclpy = pytest.importorskip("rclpy")
interfaces = pytest.importorskip("flexarm_interfaces.msg", reason="needs flexarm_interfaces")
conversions = pytest.importorskip("flexarm_model.conversions")
node_parts = pytest.importorskip("flexarm_model.ros.node")

from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from domain_coordinator import domain_id  # noqa: E402
from geometry_msgs.msg import PoseWithCovarianceStamped  # noqa: E402
from nav_msgs.msg import Odometry  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from sensor_msgs.msg import Imu, JointState  # noqa: E402
from std_msgs.msg import Bool  # noqa: E402

from flexarm_model.served.linearize import linearize  # noqa: E402
from flexarm_model.tree.reduced_tree import ReducedTree  # noqa: E402

PROGRAM = "import sys; from flexarm_estimator.estimator_node import main; sys.exit(main())"
PERIOD_NS = 5_000_000
PATIENCE = 90.0  # s; the first start compiles the arm, and others may use the cores


def start(domain, *overrides, extra=()):
    arguments = [*(item for override in overrides for item in ("-p", override)), *extra]
    environment = {key: value for key, value in os.environ.items() if key != "_ROS_WHEELS_BOOTSTRAP_COMPLETE"}
    environment |= {"ROS_DOMAIN_ID": str(domain), "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST"}
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM, "--ros-args", *arguments],
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def told(report):
    return {status.name: status.message for status in report.status}


class Bench:
    """Plays model node and rig towards one estimator process."""

    def __init__(self, domain):
        self.context = rclpy.Context()
        rclpy.init(context=self.context, domain_id=domain)
        self.node = rclpy.create_node("bench", namespace="flexarm", context=self.context)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self.states, self.tips, self.diagnostics, self.ready = [], [], [], []
        reliable, latched = node_parts.RELIABLE_QOS, node_parts.LATCHED_QOS
        subscribe, publisher = self.node.create_subscription, self.node.create_publisher
        subscribe(interfaces.ModalState, "modal_state", self.states.append, reliable)
        subscribe(Odometry, "end_effector", self.tips.append, reliable)
        subscribe(DiagnosticArray, "/diagnostics", self.diagnostics.append, reliable)
        subscribe(Bool, "estimator/ready", self.ready.append, latched)
        self.joints = publisher(JointState, "joint_states", reliable)
        self.strain = publisher(interfaces.StrainArray, "strain", reliable)
        self.imu = publisher(Imu, "imu/tip_accelerometer", reliable)
        self.camera = publisher(PoseWithCovarianceStamped, "camera/pose", reliable)
        self.effort = publisher(JointState, "applied_effort", reliable)
        self.tick = publisher(interfaces.Tick, "tick", reliable)
        self.model = publisher(interfaces.ReducedModel, "model", latched)
        self.model.publish(
            conversions.model_to_msg(linearize(ReducedTree(single_link(), use_compiler=False)))
        )

    def wait(self, condition):
        deadline = time.monotonic() + PATIENCE
        while not condition() and time.monotonic() < deadline:
            self.executor.spin_once(timeout_sec=0.05)
        assert condition()

    def send_tick(self, k, position=0.0, strain=0.0):
        stamp = conversions.ns_to_stamp(k * PERIOD_NS)
        joints = JointState(name=["base.rz"], position=[position])
        gauge = interfaces.StrainArray(names=["root_strain"], strain=[strain])
        imu = Imu()
        imu.header.frame_id = "strip.sensor"
        tick = interfaces.Tick(
            sequence=k, topics=["strain", "imu/tip_accelerometer", "joint_states"], counts=[1, 1, 1]
        )
        for msg in (joints, gauge, imu, tick):
            msg.header.stamp = stamp
        self.tick.publish(tick)  # before its messages: the node has to wait for them
        self.strain.publish(gauge)
        self.imu.publish(imu)
        self.joints.publish(joints)

    def close(self):
        self.executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self.context)


@pytest.fixture
def domain():
    with domain_id() as number:
        yield int(number)


def test_every_tick_is_answered_by_one_state_and_nothing_bad_gets_out(domain):
    process = start(domain, "lockstep:=true")
    bench = Bench(domain)
    try:
        bench.wait(lambda: bench.ready and bench.ready[-1].data)
        bench.strain.publish(interfaces.StrainArray(strain=[0.0] * 20_000))
        bench.strain.publish(b"\0\1\0\0" + b"\xff" * 60)  # no message; not told within 5 s
        for k in range(60):
            bad = k % 10 == 9
            bench.send_tick(k, np.nan if bad else 0.1, np.inf if bad else 0.0)
            bench.wait(lambda k=k: len(bench.states) == k + 1 and len(bench.tips) == k + 1)
        # reports may have been made before the first tick
        bench.wait(lambda: bench.diagnostics and "estimator: camera" in told(bench.diagnostics[-1]))
        assert "estimator: strain" in told(bench.diagnostics[-1])  # refused, by name
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=PATIENCE)
    finally:
        process.kill()
        bench.close()
    assert process.returncode == 0, err
    assert "strain: message of more than 100000 bytes" in err
    stamps = [conversions.stamp_to_ns(msg.header.stamp) for msg in bench.states]
    assert stamps == [k * PERIOD_NS for k in range(60)]
    for state, tip in zip(bench.states, bench.tips, strict=True):
        assert np.isfinite(
            [*state.theta, *state.eta, *state.theta_dot, *state.eta_dot, *state.covariance]
        ).all()
        assert np.isfinite([*tip.pose.covariance, *tip.twist.covariance]).all()
    last = bench.states[-1]
    assert last.theta[0] == pytest.approx(0.1, abs=1e-4)
    encoder = next(sensor for sensor in last.sensors if sensor.name == "encoder")
    assert (encoder.accepted, encoder.rejected, encoder.reason) == (54, 6, "not finite")
    assert "estimator: camera" in told(bench.diagnostics[-1])


@pytest.mark.parametrize(
    ("override", "reason"),
    [
        ("gate:=-1.0", "gate: -1.0 is not"),
        ("manipulator:=no_such_arm", "no_such_arm"),
        ("preset:=no_such_preset", "no_such_preset"),
        ("gaet:=5.0", "gaet: unknown parameter of estimator"),
    ],
)
def test_a_wrong_setting_ends_the_node_with_one_line_that_names_it(domain, override, reason):
    process = start(domain, override)
    _, err = process.communicate(timeout=PATIENCE)
    assert process.returncode == 2
    assert reason in err.splitlines()[-1]
    assert len(err.splitlines()) == 1


def test_a_node_that_was_held_up_skips_the_periods_that_are_over(domain):
    process = start(domain)
    bench = Bench(domain)

    def say(stamp_ns):
        msg = JointState(name=["base.rz"], position=[0.1])
        msg.header.stamp = conversions.ns_to_stamp(stamp_ns)
        bench.joints.publish(msg)

    def has_answered():
        say(time.time_ns())
        return bool(bench.states)

    try:
        bench.wait(lambda: bench.ready and bench.ready[-1].data)
        bench.wait(has_answered)
        process.send_signal(signal.SIGSTOP)
        last = time.time_ns()
        for k in range(40):
            say(last - (39 - k) * PERIOD_NS)
        before = len(bench.states)
        process.send_signal(signal.SIGCONT)
        bench.wait(lambda: conversions.stamp_to_ns(bench.states[-1].header.stamp) == last)
    finally:
        process.kill()
        bench.close()
    assert len(bench.states) - before < 20
