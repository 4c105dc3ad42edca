"""Models of real arms change on the way: the vibration goes on without a jump, and energy is not made."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from flexarm_estimator.state.state_map import state_map
from flexarm_estimator.tool.tip import PlainTip
from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

FOLDER = Path(__file__).parents[2] / "flexarm_bringup/config/manipulators"
MACHINES = ["variable_stiffness", "planar_3rrr", pytest.param("serial_6r", marks=pytest.mark.slow)]
FINE, COARSE = 0.02, 0.13  # rad; the schedules of the 3RRR and the 6R serve a model every 0.05 and 0.13 rad


@cache
def tree_of(name):
    return ReducedTree(load_config(FOLDER / f"{name}.yaml"))


@cache
def pair(name, distance, preset_pose="home"):
    """Return models ``distance`` apart and the mass of the tree at the second pose."""
    tree = tree_of(name)
    pose = tree.config.poses.get(preset_pose, tree.config.home)
    step = np.random.default_rng(7).normal(size=pose.size)
    old, new = (linearize(tree, pose + part * step / np.linalg.norm(step)) for part in (0.0, distance))
    return old, new, tree.mass_matrix(new.q0)


def vibrations(old, count=20):
    """Return states of random vibration, slow modes larger: all move equally fast at 1 kg^0.5 mm 2 pi f_1."""
    rng, n, n_theta = np.random.default_rng(8), old.n, old.n_theta
    rate = 1e-3 * old.omega[0]
    for _ in range(count):
        x = np.zeros(2 * n + n_theta)
        x[:n_theta] = old.pose
        x[n_theta:n] = rate / old.omega * rng.normal(size=old.n_eta)
        x[n + n_theta : 2 * n] = rate * rng.normal(size=old.n_eta)
        yield x


def energy(model, x):
    n, n_theta = model.n, model.n_theta
    return (x[n + n_theta : 2 * n] ** 2).sum() / 2 + ((model.omega * x[n_theta:n]) ** 2).sum() / 2


def jumps(name, distance, is_weighted=True):
    """Return the RMS jump of the vibration at the tip and at all sensors, over its size, and energies."""
    old, new, M = pair(name, distance)
    T = state_map(old, new, M if is_weighted else None).T
    before, after = PlainTip(old, tree_of(name)), PlainTip(new, tree_of(name))
    rows = [
        i for i, row in enumerate(old.outputs.names) if not row.startswith(("tip.", "camera.", "tracker."))
    ]
    tip, rigid_tip, sensors, ratio = [], [], [], []
    for x in vibrations(old):
        still = x.copy()
        still[old.n_theta : old.n] = still[old.n + old.n_theta : 2 * old.n] = 0.0
        was = before.pose(x)[:3, 3] - before.pose(still)[:3, 3]
        is_now = after.pose(T @ x)[:3, 3] - after.pose(T @ still)[:3, 3]
        tip.append(((is_now - was) @ (is_now - was), was @ was))
        rigid = after.pose(T @ still)[:3, 3] - before.pose(still)[:3, 3]
        rigid_tip.append(np.linalg.norm(rigid))
        said = old.outputs.C_pos[rows] @ (x - still)[: old.n]
        says = new.outputs.C_pos[rows] @ (T @ (x - still))[: new.n]
        sensors.append(((says - said) @ (says - said), said @ said))
        ratio.append(energy(new, T @ x) / energy(old, x))
    shares = [float(np.sqrt(np.sum(part, axis=0)[0] / np.sum(part, axis=0)[1])) for part in (tip, sensors)]
    return (*shares, max(rigid_tip), np.array(ratio))


@pytest.mark.parametrize("name", MACHINES)
def test_tip_and_sensors_go_on_and_the_jump_shrinks_with_the_distance_of_the_poses(name):
    tip, sensors, rigid, _ = jumps(name, FINE)
    far_tip, far_sensors, far_rigid, _ = jumps(name, COARSE)
    assert tip < 0.02
    assert sensors < 0.05
    assert far_tip < 0.2
    assert far_sensors < 0.3
    shrinks = FINE / COARSE * 2.0  # at least in first order; twice that where it is small already
    assert tip < max(shrinks * far_tip, 1e-4)
    assert sensors < shrinks * far_sensors
    assert (
        rigid < (2 * FINE / COARSE) ** 2 * far_rigid + 1e-9
    )  # of second order: the old model's static shape


@pytest.mark.parametrize("name", MACHINES)
def test_a_change_of_models_makes_no_energy(name):
    """Modes turn, so single states gain and lose a little; on the average nothing is made."""
    ratio = jumps(name, FINE)[3]
    assert ratio.max() < 1.02
    assert abs(ratio.mean() - 1.0) < 0.01


@pytest.mark.parametrize("name", MACHINES)
def test_the_mass_of_the_tree_makes_the_projection_no_worse(name):
    weighted, plain = jumps(name, FINE), jumps(name, FINE, is_weighted=False)
    assert weighted[0] ** 2 + weighted[1] ** 2 <= 1.05 * (plain[0] ** 2 + plain[1] ** 2)


@pytest.mark.parametrize("name", MACHINES)
def test_kinetic_energy_never_grows_by_the_projection_itself(name):
    """Contraction: in the metric of the tree's mass at the new pose a projection makes nothing longer."""
    old, new, M = pair(name, COARSE)
    T = state_map(old, new, M).T
    for x in vibrations(old):
        rate_old = old.Phi[:, old.n_theta :] @ x[old.n + old.n_theta : 2 * old.n]
        rate_new = new.Phi[:, new.n_theta :] @ (T @ x)[new.n + new.n_theta : 2 * new.n]
        assert rate_new @ M @ rate_new <= rate_old @ M @ rate_old * (1 + 1e-9)
