"""The script of a soak without nodes: what a usable state may be off by while sensors lie in moves.

    ./flexarm test src/flexarm_bringup/test/test_soak_in_one_process.py -s

tells the worst moments. A soak by the clock is another one every time; this one comes again.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from flexarm_bringup.closed_loop import run_loop
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim.sensor_fault_text import parse_faults
from flexarm_bringup.sim_run.study import loop_settings
from flexarm_bringup.soak.script import Script, move, random_fault, random_goal
from flexarm_bringup.soak.worst import Moment, WorstMoments
from flexarm_bringup.tasks.task_for import task_for
from flexarm_controller.reference import Reference
from flexarm_estimator.estimate import Estimate
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.tree.reduced_tree import ReducedTree

pytestmark = pytest.mark.slow

Array = NDArray[np.float64]
PAUSE = 2.8  # s between two moves
BOUND = 5e-3  # m; 0.7 and 1.3 mm were seen


def moves(rng: np.random.Generator, config: ManipulatorConfig, seconds: float) -> Reference:
    """Return random moves, one after the other."""
    begin, pose, parts = 1.0, np.array(config.home), []
    while begin < seconds:
        goal = random_goal(rng, config)
        each = move(rng, pose, goal, config)
        parts.append((each.t + begin, each.theta, each.theta_dot, each.theta_ddot))
        begin, pose = begin + float(each.t[-1]) + PAUSE, each.theta[-1]
    return Reference(*(np.concatenate(part) for part in zip(*parts, strict=True)))


@pytest.mark.parametrize(
    ("seed", "every", "seconds"),
    [
        pytest.param(20, 3.2, 112.0, id="an encoder's sign flips in a move at 110.1 s"),
        pytest.param(42, 4.0, 98.0, id="an encoder sticks at 95.2 s while the arm creeps"),
    ],
)
def test_a_usable_state_stays_near_the_truth_while_sensors_fail_at_random(
    seed: int, every: float, seconds: float
) -> None:
    task = task_for("single_link")
    config = load_config(find_manipulator(task.manipulator), task.presets[0])
    settings = loop_settings(task, "mpc", RigSettings(seed=seed))
    hardware, script = Hardware(config, settings.rig), Script(seed + 100, every, 0.0)
    worst, faults = WorstMoments(), ["none yet"]

    def look(rig: Hardware, estimate: Estimate) -> Mapping[str, Array]:
        """Break what is due, and look at the tip."""
        for _ in script.due(rig.t):
            faults.append(random_fault(script.rng, config.sensors))
            rig.drives.set_faults(parse_faults(faults[-1], config.sensors))
        error = float(np.linalg.norm(estimate.T_world_tip[:3, 3] - rig.rig.plant.tip_pose()[:3, 3]))
        if estimate.status in ("ok", "degraded"):
            worst.note(Moment(rig.t, error, "", True, estimate.reason, faults[-1]))
        return {}

    reference: Any = moves(np.random.default_rng(seed), config, 500.0)
    run_loop(hardware, ReducedTree(config), reference, seconds, settings, look)
    for at in worst.worst:
        print(f"{at.t:7.2f} s  {1e3 * at.error:5.1f} mm  {at.said}  |  {at.fault}")
    assert len(faults) > 20
    assert worst.worst[0].error <= BOUND
