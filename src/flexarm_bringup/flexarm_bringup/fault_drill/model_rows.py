"""Row about the served models: what they say at many poses, and whose state is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, null_space

from flexarm_bringup.fault_drill.controller_stand import ControllerStand, state_of
from flexarm_bringup.fault_drill.findings import Finding
from flexarm_bringup.fault_drill.row import Row
from flexarm_model.served.linearize import constraint_stiffness, find_equilibrium, linearize
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
POSES = 25
NEAR, STALE = 1.0 / 360.0, 5.0 / 360.0  # of a turn; of a linear axis the same share of its range
TURN = 2.0 * np.pi


def served_models(stand: ControllerStand) -> list[Finding]:
    """Serve a model at poses along the task, and compare with the finer model of the rig at each of them."""
    tree, fine = stand.loop.tree, stand.hardware.rig.plant.tree
    poses = stand.loop.course.reference.sample(np.linspace(0.0, stand.loop.course.end, POSES))[0]
    off, jump, taken = [], [], 0
    controller = stand.controller()
    for pose in poses:
        model = linearize(tree, pose)
        off.append(abs(model.omega / locked_frequencies(fine, pose)[: model.n_eta] - 1.0).max())
        jump.append(abs(linearize(tree, _moved(stand, pose, NEAR)).omega / model.omega - 1.0).max())
        stale = linearize(tree, _moved(stand, pose, STALE))
        controller.adopt(model)
        state = state_of(stale, np.concatenate([stale.pose, np.zeros(2 * stale.n - stale.n_theta)]), 0.0)
        taken += controller.step(state).mode == "mpc"
        taken += (
            controller.step(replace(state, model_id=model.model_id)).mode != "mpc"
        )  # the sound one is not
    return [
        Finding(f"frequency off a finer model, {POSES} poses", 100.0 * float(max(off)), 1.0, "%"),
        Finding("jump of a frequency within 1 degree", 100.0 * float(max(jump)), 2.0, "%"),
        Finding("states of a model 5 degrees away that were used, or sound ones refused", taken, 0),
    ]


def locked_frequencies(tree: ReducedTree, pose: Array) -> Array:
    """Return all frequencies with the actuated axes locked at a pose, by one dense eigenproblem [rad/s]."""
    q, force = find_equilibrium(tree, pose)
    M, _, K, _ = tree.linearisation(q)
    K = K + constraint_stiffness(tree, q, force)
    rows = np.eye(tree.n_q)[tree.actuated]
    if tree.n_c:
        rows = np.vstack([rows, tree.constraints(q)[1]])
    Z = null_space(rows)
    return np.asarray(np.sqrt(eigh(Z.T @ K @ Z, Z.T @ M @ Z, eigvals_only=True)))


def _moved(stand: ControllerStand, pose: Array, share: float) -> Array:
    """Return a pose near another one, every axis moved towards the middle of its range."""
    low, high = stand.limits.position_low, stand.limits.position_high
    middle = np.where(np.isfinite(low + high), (low + high) / 2.0, np.inf)
    step = share * np.minimum(TURN, high - low)
    return np.asarray(pose + np.where(pose < middle, step, -step))


ROWS = (Row(34, "models of 25 poses", "right, continuous, and no state of a stale one used", served_models),)
