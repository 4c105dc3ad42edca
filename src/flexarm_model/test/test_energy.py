"""Free motion without damping keeps its energy, in both trees."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from arms import arm, tree, with_modes
from scipy.integrate import solve_ivp

from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.tree.reduced_tree import ReducedTree

DURATION = 0.15  # [s]: the joints turn by about a radian
TOLERANCE = {"method": "DOP853", "rtol": 1e-10, "atol": 1e-12}
DRIFT = 1e-6  # of the kinetic energy at the start; the integrator's own share is 1e-9


@pytest.mark.parametrize(("name", "modes"), [("spatial_rigid", 0), ("planar", 3), ("spatial", 5)])
def test_the_reduced_tree_conserves_energy(name: str, modes: int) -> None:
    """Kinetic energy plus the work against static forces, which have a potential (see test_reduced_tree)."""
    arm_tree = tree(name) if modes == 0 else ReducedTree(with_modes(arm(name), modes), use_compiler=False)
    f, n = arm_tree.functions, arm_tree.n_q
    D = arm_tree.D

    def rate(_: float, x: np.ndarray) -> np.ndarray:
        q, v = x[:n], x[n : 2 * n]
        work = v @ np.array(f["bias"](q, 0 * v)) + v @ D @ v
        return np.concatenate([v, f["forward_dynamics"](q, v, 0 * v), [work]])

    start = np.zeros(2 * n + 1)
    start[n : n + len(arm_tree.axes)] = 4.0
    end = solve_ivp(rate, (0, DURATION), start, **TOLERANCE).y[:, -1]

    def energy(x: np.ndarray) -> float:
        v = x[n : 2 * n]
        return float(v @ np.array(f["mass_matrix"](x[:n])) @ v / 2 + x[-1])

    assert abs(end[: len(arm_tree.axes)]).max() > 0.3
    assert energy(end) == pytest.approx(energy(start), rel=DRIFT)


@pytest.mark.parametrize("name", ["planar", "spatial"])
def test_the_segment_tree_conserves_energy(name: str) -> None:
    """Kinetic and gravitational energy by Pinocchio, and that of the springs."""
    arm_tree = SegmentTree(arm(name), 4)
    n = arm_tree.n_q

    def rate(_: float, x: np.ndarray) -> np.ndarray:
        return np.concatenate([x[n:], arm_tree.forward_dynamics(x[:n], x[n:], np.zeros(n))])

    def energy(x: np.ndarray) -> float:
        model, data = arm_tree.model, arm_tree.data
        kinetic = pin.computeKineticEnergy(model, data, x[:n], x[n:])  # rotors included
        potential = pin.computePotentialEnergy(model, data, x[:n])
        return float(kinetic + potential + x[:n] @ arm_tree.K @ x[:n] / 2)

    start = np.zeros(2 * n)
    start[n + np.array(arm_tree.actuated)] = 4.0
    end = solve_ivp(rate, (0, DURATION / 3), start, **TOLERANCE).y[:, -1]
    assert abs(end[:n]).max() > 0.1
    assert energy(end) == pytest.approx(energy(start), rel=DRIFT)
