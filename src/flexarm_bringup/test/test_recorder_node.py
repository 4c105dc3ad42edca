"""The recorder takes everything that is sent, closes its bag on a signal and survives a full disk."""

import re
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from flexarm_bringup.bags.bag_reader import check_bag, decode
from flexarm_bringup.processes.surroundings import defaults

pytestmark = pytest.mark.ros
pytest.importorskip("rclpy", reason="needs ROS")

RECORDER = "import sys; from flexarm_bringup.recorder_node import main; sys.exit(main())"

# Publishes every stream, waits until the recorder is ready and listens, sends 50 lockstep ticks, and waits
# until it has received them and answers a question that was asked later.
RIG = textwrap.dedent("""
    import sys, time
    import rclpy
    from lifecycle_msgs.srv import GetState
    from rclpy.executors import SingleThreadedExecutor
    from std_msgs.msg import Bool
    from flexarm_bringup.message_class import message_class
    from flexarm_bringup.topics import streams
    from flexarm_model.conversions import ns_to_stamp
    from flexarm_model.ros.node import LATCHED_QOS, PERIODIC_QOS
    rclpy.init()
    node = rclpy.create_node("rig", namespace="flexarm")
    publishers, kinds = {}, {}
    for stream in streams(["tip_accelerometer"]):
        kinds[stream.topic] = message_class(stream.type)
        qos = LATCHED_QOS if stream.is_latched else PERIODIC_QOS
        publishers[stream.topic] = node.create_publisher(kinds[stream.topic], stream.topic, qos)
    flag = node.create_publisher(Bool, "rig/ready", LATCHED_QOS)
    flag.publish(Bool(data=True))
    ready = []
    node.create_subscription(Bool, "recorder/ready", lambda msg: ready.append(msg.data), LATCHED_QOS)
    question = node.create_client(GetState, "recorder/get_state")
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    def wait(holds):
        deadline = time.monotonic() + 60.0
        while not holds() and time.monotonic() < deadline:
            executor.spin_once(timeout_sec=0.05)
    sent = ["joint_states", "strain", "applied_effort"]
    needed = [*sent, "modal_state", *sys.argv[1:]]
    wait(lambda: True in ready and all(publishers[t].get_subscription_count() for t in needed))
    wait(question.service_is_ready)
    time.sleep(1.0)  # its subscriptions may know of us later than we of them
    for k in range(50):
        for topic in [*sent, "modal_state", "tick"]:
            msg = kinds[topic]()
            msg.header.stamp = ns_to_stamp(5_000_000 * k)
            if topic == "tick":
                msg.sequence, msg.topics, msg.counts = k, sent, [1] * len(sent)
            publishers[topic].publish(msg)
        time.sleep(0.002)
    wait(lambda: all(publishers[topic].wait_for_all_acked() for topic in needed))
    wait(question.call_async(GetState.Request()).done)
""")


BEST_EFFORT_RIG = RIG.replace("PERIODIC_QOS", "SENSOR_QOS")


def record(
    environment: dict[str, str], bag: Path, number: int, *parameters: str, limit: str = "", rig: str = RIG
) -> tuple[int, str]:
    """Record the rig's 50 ticks, end the recorder with a signal, return its exit code and what it said."""
    environment = {**environment, **defaults(environment)}  # 0.1 s between heartbeats instead of 3
    arguments = ["--ros-args", "-p", f"bag:={bag}"]
    for item in ("partners:=[rig]", *parameters):
        arguments += ["-p", item]
    recorder = subprocess.Popen(
        [sys.executable, "-c", limit + RECORDER, *arguments],
        env=environment,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        needed = ["tick"] if "lockstep:=true" in parameters else []
        subprocess.run([sys.executable, "-c", rig, *needed], env=environment, timeout=300.0, check=True)
        recorder.send_signal(number)
        _, said = recorder.communicate(timeout=60.0)
    finally:
        recorder.kill()
    return recorder.returncode, said


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_lockstep_run_is_recorded_whole_and_in_order(
    number: int, ros_environment: dict[str, str], tmp_path: Path
) -> None:
    code, said = record(ros_environment, tmp_path / "bag", number, "lockstep:=true")
    assert code == 0, said
    assert "0 lost" in said
    bag = check_bag(tmp_path / "bag")
    assert bag.custom["preset"] == "geared"
    assert "flexarm/1" in bag.custom["description"]
    order = ["joint_states", "strain", "applied_effort", "tick", "modal_state"]
    expected = [(5_000_000 * k, f"/flexarm/{topic}") for k in range(50) for topic in order]
    received = [(r.log_time_ns, r.name) for r in bag.records if r.name != "/diagnostics"]
    assert received == expected
    last = [record for record in bag.records if record.name != "/diagnostics"][-1]
    assert decode(last).header.stamp.nanosec == 49 * 5_000_000


def test_in_real_time_messages_are_logged_as_they_arrive(
    ros_environment: dict[str, str], tmp_path: Path
) -> None:
    code, said = record(ros_environment, tmp_path / "bag", signal.SIGINT, "lockstep:=false")
    assert code == 0, said
    bag = check_bag(tmp_path / "bag")
    stamps = [decode(r).header.stamp.nanosec for r in bag.records if r.name == "/flexarm/joint_states"]
    assert stamps == [5_000_000 * k for k in range(50)], said
    assert "/flexarm/tick" not in bag.counts
    times = [record.log_time_ns for record in bag.records]
    assert times == sorted(times)
    assert times[0] > 1_600_000_000_000_000_000


def test_what_is_offered_best_effort_is_recorded_and_silent_sensors_are_named(
    ros_environment: dict[str, str], tmp_path: Path
) -> None:
    """No message of such a driver was in the bag, and "0 lost" was all that the last words told."""
    code, said = record(ros_environment, tmp_path / "bag", signal.SIGINT, rig=BEST_EFFORT_RIG)
    assert code == 0, said
    counts = check_bag(tmp_path / "bag").counts
    for topic in ("joint_states", "strain", "modal_state"):
        assert (
            25 <= counts[f"/flexarm/{topic}"] <= 50
        )  # of 50; some may be lost on a busy machine, none twice
    assert "0 lost; nothing came on imu/tip_accelerometer" in said


@pytest.mark.parametrize(("size", "is_in_the_middle"), [(40_000, True), (60_000, False)])
def test_a_full_disk_is_reported_and_does_not_end_the_node(
    size: int, is_in_the_middle: bool, ros_environment: dict[str, str], tmp_path: Path
) -> None:
    """In the middle of the messages, or when all are written and the index is not."""
    limit = textwrap.dedent(f"""
        import resource, signal
        import flexarm_bringup.bags.bag_writer
        import flexarm_bringup.recorder_node
        flexarm_bringup.bags.bag_writer.CHUNK = 2000  # the disk is asked sooner
        flexarm_bringup.recorder_node.DIAGNOSTICS_PERIOD = 1e6  # not the more the slower the machine
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, ({size}, {size}))
    """)
    code, said = record(ros_environment, tmp_path / "bag", signal.SIGINT, "lockstep:=true", limit=limit)
    assert code == 1, said
    told = re.search(
        r"at most (\d+) messages in .*, (\d+) lost: recording ended: \[Errno 27\] File too", said
    )
    assert told, said
    kept, lost = map(int, told.groups())
    assert (lost > 0) == is_in_the_middle
    assert 250 <= kept + lost <= 252  # five topics of 50 ticks, and that the disk is full on /diagnostics
    assert "Traceback" not in said


def test_an_existing_bag_is_refused_with_one_line(ros_environment: dict[str, str], tmp_path: Path) -> None:
    (tmp_path / "bag").mkdir()
    command = [sys.executable, "-c", RECORDER, "--ros-args", "-p", f"bag:={tmp_path / 'bag'}"]
    done = subprocess.run(
        command, env=ros_environment, capture_output=True, text=True, timeout=120.0, check=False
    )
    assert done.returncode == 2
    assert done.stderr.splitlines() == [
        f"RecorderNode: command line: /flexarm/recorder: bag: {tmp_path / 'bag'} exists already"
    ]
