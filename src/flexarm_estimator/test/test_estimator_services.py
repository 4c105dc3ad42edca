"""The services of a running estimator node, and another robot's topics fed to it by remapping."""

import time
from pathlib import Path

import pytest
from test_estimator_node import Bench, conversions, domain, interfaces, node_parts, start

pytestmark = [pytest.mark.ros, pytest.mark.slow]

from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from flexarm_interfaces.msg import Intervention, KnownState  # noqa: E402
from flexarm_interfaces.srv import SetNoise, SetState, ToggleSensor  # noqa: E402
from rclpy.qos import QoSProfile  # noqa: E402
from sensor_msgs.msg import Imu, JointState  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402

__all__ = ["domain"]
from flexarm_model.process.kept import begin  # noqa: E402

ARM = Path(__file__).parents[2] / "flexarm_bringup" / "config" / "manipulators" / "single_link.yaml"

REASONS = (
    "no sensor 'gyro'; allowed: encoder",
    "channels: tx, ty, tz, rx, ry would be left",
    "value: -1.0; allowed: from",
    "theta: 0 numbers",
)
KINDS = [Intervention.TOGGLE_SENSOR, Intervention.SET_NOISE, Intervention.SET_STATE, Intervention.RESET]


def call(bench, kind, name, request):
    """Call a service of the estimator and return its answer."""
    client = bench.node.create_client(kind, f"estimator/{name}")
    bench.wait(client.service_is_ready)
    future = client.call_async(request)
    bench.wait(future.done)
    return future.result()


def test_every_service_is_done_at_the_next_step_or_refused_by_name_and_told_to_recorders(domain):
    process = start(domain, "lockstep:=true", f"manipulator:={ARM}")
    bench = Bench(domain)
    told = []
    bench.node.create_subscription(Intervention, "estimator/interventions", told.append, QoSProfile(depth=10))
    try:
        bench.wait(lambda: bench.ready and bench.ready[-1].data)
        for k in range(10):
            bench.send_tick(k, 0.1)
            bench.wait(lambda k=k: len(bench.states) == k + 1)
        refused = [
            call(bench, ToggleSensor, "toggle_sensor", ToggleSensor.Request(name="gyro")),
            call(bench, ToggleSensor, "toggle_sensor", ToggleSensor.Request(name="camera", channels=["rz"])),
            call(bench, SetNoise, "set_noise", SetNoise.Request(name="encoder", value=[-1.0])),
            call(bench, SetState, "set_state", SetState.Request(state=KnownState(theta=[]))),
        ]
        known = KnownState(theta=[0.1], theta_sigma=[1e-5], theta_dot_sigma=[1e-4])
        done = [
            call(bench, ToggleSensor, "toggle_sensor", ToggleSensor.Request(name="root_strain", is_on=False)),
            call(bench, SetNoise, "set_noise", SetNoise.Request(name="encoder", value=[1e-3])),
            call(bench, SetState, "set_state", SetState.Request(state=known)),
        ]
        bench.send_tick(10, 0.1)
        bench.wait(lambda: len(bench.states) == 11 and len(told) == 3)
        reset = call(bench, Trigger, "reset", Trigger.Request())
        bench.wait(lambda: len(told) == 4)
    finally:
        process.kill()
        process.communicate(timeout=20.0)
        bench.close()
    answers = [*refused, *done, reset]
    assert [answer.success for answer in answers] == [False] * 4 + [True] * 4
    for word, answer in zip(REASONS, refused, strict=True):
        assert word in answer.message
    assert [msg.kind for msg in told] == KINDS
    stamps = [conversions.stamp_to_ns(msg.header.stamp) for msg in told]
    assert stamps == [9 * 5_000_000] * 3 + [10 * 5_000_000]
    state = bench.states[-1]
    gauge = next(sensor for sensor in state.sensors if sensor.name == "root_strain")
    assert gauge.status == interfaces.SensorHealth.OFF
    assert state.covariance[0] < 1e-7  # the encoder alone, with the noise that was set, gives 1e-6


def test_a_sensor_that_was_switched_off_stays_so_when_the_estimator_crashes_and_comes_back(
    domain, tmp_path, monkeypatch
):
    for name, value in begin(tmp_path).items():
        monkeypatch.setenv(name, value)
    process = start(domain, f"manipulator:={ARM}")
    bench = Bench(domain)
    try:
        bench.wait(lambda: bench.ready and bench.ready[-1].data)
        off = ToggleSensor.Request(name="root_strain", is_on=False)
        assert call(bench, ToggleSensor, "toggle_sensor", off).success
        process.kill()
        process.communicate(timeout=20.0)
        process = start(domain, f"manipulator:={ARM}")
        begun, joints = len(bench.states), joint_states()
        bench.wait(lambda: bench.joints.publish(next(joints)) or len(bench.states) > begun)
    finally:
        process.kill()
        _, err = process.communicate(timeout=20.0)
        bench.close()
    status = {sensor.name: sensor.status for sensor in bench.states[begun].sensors}
    assert status["root_strain"] == interfaces.SensorHealth.OFF
    assert "goes on with what services had switched or set before: root_strain is off" in err


def joint_states():
    """Yield joint states of now."""
    while True:
        msg = JointState(name=["base.rz"], position=[0.1])
        msg.header.stamp = conversions.ns_to_stamp(time.time_ns())
        yield msg


def test_a_mobile_robots_topics_do_not_stop_the_node_and_it_says_what_it_ignores(domain):
    remaps = ["-r", "joint_states:=/joint_states", "-r", "imu/tip_accelerometer:=/imu"]
    process = start(domain, f"manipulator:={ARM}", extra=remaps)
    bench = Bench(domain)
    robot = {
        "joint_states": bench.node.create_publisher(JointState, "/joint_states", node_parts.RELIABLE_QOS),
        "imu": bench.node.create_publisher(Imu, "/imu", node_parts.RELIABLE_QOS),
    }
    heard: dict[str, dict[str, str]] = {}

    def on_diagnostics(msg):
        for status in msg.status:
            heard[status.name] = {pair.key: pair.value for pair in status.values}

    bench.node.create_subscription(DiagnosticArray, "/diagnostics", on_diagnostics, node_parts.RELIABLE_QOS)
    try:
        bench.wait(lambda: bench.ready and bench.ready[-1].data)
        bench.wait(lambda: all(publisher.get_subscription_count() for publisher in robot.values()))
        for msg in robot_messages():
            robot["imu" if isinstance(msg, Imu) else "joint_states"].publish(msg)
            bench.executor.spin_once(timeout_sec=0.002)
        bench.wait(
            lambda: "refused: no joint 'base.rz' in joint_states" in heard.get("estimator: encoder", {})
        )
        time.sleep(0.1)
        assert process.poll() is None
    finally:
        process.kill()
        process.communicate(timeout=20.0)
        bench.close()
    assert (
        "refused: unknown joints 'wheel_left_joint', 'wheel_right_joint'" in heard["estimator: joint_states"]
    )
    assert "refused: frame 'base_footprint' is not 'strip.sensor'" in heard["estimator: tip_accelerometer"]
    assert bench.states[-1].status == interfaces.ModalState.STARTING


def robot_messages():
    """Yield the messages of the recorded robot."""
    folder = Path(__file__).parents[3] / "tests" / "recorded" / "mobile_robot"
    bag_reader = pytest.importorskip("flexarm_bringup.bags.bag_reader")
    read = pytest.importorskip("flexarm_bringup.conversions").deserialise
    for record in bag_reader.check_bag(folder).records:
        yield read(record.cdr, record.type)
