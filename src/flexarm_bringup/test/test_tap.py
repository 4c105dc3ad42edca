"""A tap on the tip, which no model knows of: the gate may not make of it more than it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flexarm_bringup.closed_loop import run_loop
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim_run.conditions import NOMINAL
from flexarm_bringup.sim_run.study import loop_settings, sim_jobs
from flexarm_bringup.tasks.task_for import task_for
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.tree.reduced_tree import ReducedTree

ARM, AT, UNTIL = "single_link", 1.1, 2.1  # s; it is hit on its way
UNGATED = 100.0  # sigma


def largest_error(impulse: float, seed: int, gate: float | None) -> float:
    """Return the largest error of a usable tip [m] after a tap across the strip [N s], under joint PD."""
    task, rig = task_for(ARM), RigSettings(seed=seed)
    (job,) = sim_jobs(task, task.presets[:1], [NOMINAL])
    config = load_config(find_manipulator(task.manipulator), job.preset)
    tree, errors = ReducedTree(replace(config, home=job.course.home)), [0.0]
    settings = loop_settings(task, "pd", rig)
    if gate is not None:
        settings = replace(settings, estimator=replace(settings.estimator, gate=gate, lone_gate=gate))

    def observe(hardware, estimate):
        plant = hardware.rig.plant
        if abs(hardware.t - AT) < 1e-9:
            across = np.asarray(plant.tree.tip_jacobian(plant.q))[1]
            plant.v[:] += impulse * np.linalg.solve(plant.tree.mass_matrix(plant.q), across)
        if hardware.t > AT and estimate.is_usable:
            errors.append(np.linalg.norm(estimate.T_world_tip[:3, 3] - hardware.rig.truth().tip[:3]))
        return {}

    run_loop(Hardware(tree.config, rig), tree, job.course.reference, UNTIL, settings, observe)
    return float(max(errors))


@pytest.mark.parametrize(
    ("impulse", "seed"),
    [
        (0.01, 2),
        *(pytest.param(p, s, marks=pytest.mark.slow) for p in (0.003, 0.01, 0.03, 0.1) for s in (3, 4)),
    ],
)
def test_a_tip_that_is_tapped_is_told_about_as_well_as_without_a_gate(impulse: float, seed: int) -> None:
    """Gauge and accelerometer swung through the prediction, and doubt came late: up to 6.7 times as far."""
    assert largest_error(impulse, seed, None) <= 2.5 * largest_error(impulse, seed, UNGATED)
