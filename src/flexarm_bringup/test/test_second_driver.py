"""A simulated rig is not started beside a driver of a real one."""

import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from flexarm_bringup.cli import main

pytestmark = pytest.mark.ros
COMMAND = [sys.executable, "-m", "flexarm_bringup.cli", "rig", "--seconds", "1"]
DRIVER = """
import rclpy
from rclpy.qos import qos_profile_sensor_data
from sensor_msgs.msg import JointState
rclpy.init()
node = rclpy.create_node("lab_driver", namespace="/flexarm")
publisher = node.create_publisher(JointState, "drive_states", qos_profile_sensor_data)
node.create_timer(0.01, lambda: publisher.publish(JointState()))
print("speaks", flush=True)
rclpy.spin(node)
"""


@pytest.fixture
def driver(ros_environment: dict[str, str]) -> Iterator[None]:
    pipe = subprocess.PIPE
    command = [sys.executable, "-c", DRIVER]
    with subprocess.Popen(command, env=ros_environment, stdout=pipe, text=True) as process:
        assert process.stdout is not None and process.stdout.readline() == "speaks\n"
        yield
        process.send_signal(signal.SIGKILL)


def test_a_rig_beside_a_driver_is_refused_before_anything_is_started(
    driver: None, ros_environment: dict[str, str], tmp_path: Path
) -> None:
    ended = subprocess.run(
        [*COMMAND, "--log", str(tmp_path / "log")],
        env=ros_environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ended.returncode == 2 and "started" not in ended.stdout
    assert ended.stderr.startswith("flexarm rig: drive_states: somebody speaks there already")
    assert "leave out the simulated rig: --driver drive_states (launch: driver:=drive_states)" in ended.stderr
    assert not (tmp_path / "log").exists()


def test_with_the_driver_the_simulated_rig_stays_away(
    driver: None, ros_environment: dict[str, str], tmp_path: Path
) -> None:
    ended = subprocess.run(
        [*COMMAND, "--driver", "drive_states", "--log", str(tmp_path / "log")],
        env=ros_environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert ended.returncode == 0, ended.stderr
    assert "model, estimator, controller, guard started" in ended.stdout


def test_a_driver_that_speaks_elsewhere_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as error:
        main(["rig", "--driver", "true"])
    assert error.value.code == 2 and "'drive_states', 'joint_states'" in capsys.readouterr().err
