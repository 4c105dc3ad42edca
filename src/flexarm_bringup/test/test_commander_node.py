"""The commander: a motion whose models are not ready when it should start is sent again, with more time."""

from __future__ import annotations

import time
from collections.abc import Callable

import pytest

pytest.importorskip("rclpy", reason="needs ROS")
pytestmark = pytest.mark.ros

import rclpy  # noqa: E402
from flexarm_interfaces.msg import ControllerStatus, ModalState  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.node import Node  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from std_msgs.msg import Bool, String  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402
from trajectory_msgs.msg import JointTrajectory  # noqa: E402

from flexarm_bringup.commander_node import Commander  # noqa: E402
from flexarm_model.conversions import stamp_to_ns  # noqa: E402
from flexarm_model.ros.node import LATCHED_QOS, LOCKSTEP_QOS, RELIABLE_QOS, SENSOR_QOS  # noqa: E402

PREPARATION = 0.2  # s
OFTEN = 0.05  # s
S = 1_000_000_000  # ns
OPTIONS = ("partners:=[model]", f"preparation:={PREPARATION}", "manipulator:=single_link")


class Others(Node):  # type: ignore[misc]
    """All whom the commander waits for: sensors, estimator, controller, model node and guard.

    Attributes:
        starts: Of the references that came [ns].
        arms: How often the guard was asked to arm.
    """

    def __init__(self) -> None:
        super().__init__("others", namespace="flexarm")
        self.starts: list[int] = []
        self.arms = 0
        self._joints = self.create_publisher(JointState, "joint_states", SENSOR_QOS)
        self._states = self.create_publisher(ModalState, "modal_state", SENSOR_QOS)
        self._status = self.create_publisher(ControllerStatus, "controller_status", LOCKSTEP_QOS)
        self._models = self.create_publisher(String, "model/models", LATCHED_QOS)
        self.create_publisher(Bool, "model/ready", LATCHED_QOS).publish(Bool(data=True))
        self.create_subscription(JointTrajectory, "reference", self._on_reference, RELIABLE_QOS)
        self.create_service(Trigger, "guard/arm", self._arm)

    def say(self, now_ns: int) -> None:
        """Say all that is said again and again."""
        msg = JointState()
        msg.header.stamp.sec, msg.header.stamp.nanosec = divmod(now_ns, S)
        self._joints.publish(msg)
        self._states.publish(ModalState(status=ModalState.OK))
        self._status.publish(ControllerStatus(reason="reference accepted"))

    def make_models(self) -> None:
        """Answer the newest reference."""
        self._models.publish(String(data=f"{self.starts[-1]}: 3 models"))

    def _on_reference(self, msg: JointTrajectory) -> None:
        self.starts.append(stamp_to_ns(msg.header.stamp))

    def _arm(self, _: Trigger.Request, answer: Trigger.Response) -> Trigger.Response:
        self.arms += 1
        answer.success = True
        return answer


def test_models_that_come_after_the_start_are_given_twice_the_time(
    ros_environment: dict[str, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for key, value in ros_environment.items():
        monkeypatch.setenv(key, value)
    rclpy.init(args=["--ros-args", *(word for option in OPTIONS for word in ("-p", option))])
    try:
        commander, others = Commander(), Others()
        executor = SingleThreadedExecutor()
        executor.add_node(commander)
        executor.add_node(others)

        def until(is_true: Callable[[], bool], now_ns: int) -> bool:
            begin = said = time.monotonic()
            while not is_true() and time.monotonic() < begin + 60.0:
                if time.monotonic() > said + OFTEN:
                    said = time.monotonic()
                    others.say(now_ns)
                executor.spin_once(timeout_sec=OFTEN)
            return is_true()

        assert until(lambda: len(others.starts) == 1, 10 * S)
        assert until(lambda: commander._now_ns == 11 * S, 11 * S)  # long after the start
        others.make_models()
        assert until(lambda: len(others.starts) == 2, 11 * S)
        assert others.starts == [10 * S + round(PREPARATION * S), 11 * S + round(2 * PREPARATION * S)]
        assert others.arms == 0
        others.make_models()
        assert until(lambda: others.arms == 1, 11 * S)
    finally:
        rclpy.try_shutdown()
