"""A pressure that falls while the arm moves, over DDS by the clock: models follow, the arm goes on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from flexarm_interfaces.msg import GuardStatus, MotionStatus
from flexarm_interfaces.srv import MoveTip
from sensor_msgs.msg import FluidPressure

from flexarm_bringup.processes.running_graph_node import Ear, running
from flexarm_bringup.tasks.node_settings import arm_graph
from flexarm_model.ros.node import RELIABLE_QOS

pytestmark = [pytest.mark.ros, pytest.mark.slow]

TOPICS = ("guard_status", "motion_status", "modal_state", "model", "truth")
PATIENCE, SOFT = 60.0, 1.2e5  # s, Pa
NEAR = 3e-3  # m


class Pressure:
    """Sets the pressure of the simulated arm, and hears what its sensor tells."""

    def __init__(self, ear: Ear) -> None:
        self._ear, self.told = ear, float("nan")
        self._lead = ear.node.create_publisher(FluidPressure, "rig/parameters/pressure", RELIABLE_QOS)
        ear.node.create_subscription(FluidPressure, "parameters/pressure", self.hear, RELIABLE_QOS)
        ear.wait(lambda: self._lead.get_subscription_count() > 0, PATIENCE, "the rig")
        ear.wait(lambda: self.told > 0.0, PATIENCE, "the pressure")

    def hear(self, msg: FluidPressure) -> None:
        self.told = float(msg.fluid_pressure)

    def lead(self, pressure: float) -> None:
        """Let it be another, and wait until it is told."""
        self._lead.publish(FluidPressure(fluid_pressure=pressure))
        self._ear.wait(lambda: self.told == pressure, PATIENCE, f"{pressure:g} Pa")


def slowest(ear: Ear) -> float:
    """Return the slowest mode of the model that came last [Hz]."""
    return float(ear.latest("model").f_hz[0])


def ask(ear: Ear, x: float, y: float, z: float, duration: float = 0.0) -> int:
    """Begin to move the tip; returns the goal's number."""
    request = MoveTip.Request()
    request.target.position.x, request.target.position.y, request.target.position.z = x, y, z
    request.duration = duration
    answer = ear.ask(MoveTip, "controller/move_tip", request)
    assert answer.accepted, answer.reason
    return int(answer.goal_id)


def is_over(ear: Ear, goal_id: int) -> bool:
    last = ear.latest("motion_status")
    return last is not None and last.goal_id == goal_id and last.state > MotionStatus.EXECUTING


def test_an_arm_whose_pressure_falls_gets_softer_models_and_reaches_its_goals_all_the_same(
    tmp_path: Path,
) -> None:
    with running(arm_graph("variable_stiffness"), TOPICS, tmp_path) as (_, ear):
        ear.wait_ready("model", "estimator", "controller", "guard", "rig")
        assert ear.call("guard/arm").success
        pressure, stiff = Pressure(ear), slowest(ear)
        assert pressure.told == 2.0e5
        pressure.lead(SOFT)
        ear.wait(lambda: slowest(ear) < 0.9 * stiff, PATIENCE, "softer models")
        model_id = ear.latest("model").model_id
        ear.wait(lambda: ear.latest("modal_state").model_id == model_id, PATIENCE, "the estimator")
        ear.listen(8.0)  # the filter had learned how the stiffer arm hangs
        goal = (0.30, 0.10, 0.25)
        goal_id = ask(ear, *goal, duration=3.0)
        ear.wait(lambda: is_over(ear, goal_id), PATIENCE, "the goal")
        assert ear.latest("guard_status").mode == GuardStatus.ARMED, ear.latest("guard_status").reason
        ear.listen(0.5)
        tip = ear.latest("truth").tip
        assert np.linalg.norm(np.array([tip[0], tip[1], tip[2]]) - goal) < NEAR
        on_the_way = ask(ear, 0.22, -0.2, 0.3, duration=3.0)
        ear.listen(0.5)
        for part in (1.3, 1.45, 1.6, 1.8, 2.0):  # while it moves
            pressure.lead(part * 1e5)
        ear.wait(lambda: is_over(ear, on_the_way), PATIENCE, "the second goal")
        ear.wait(lambda: slowest(ear) > 0.95 * stiff, PATIENCE, "stiffer models")
        assert ear.latest("guard_status").mode == GuardStatus.ARMED, ear.latest("guard_status").reason
