"""The nonlinear controller's programs, iterated until they settle, have the optimum that IPOPT finds."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flexarm_bringup.bench import load_module
from flexarm_controller.limits import limits_of
from flexarm_controller.nonlinear.nonlinear_arm import NonlinearArm
from flexarm_controller.nonlinear.nonlinear_mpc import NonlinearMpc
from flexarm_controller.nonlinear.settings import NmpcConfig
from flexarm_controller.reference import Reference
from flexarm_controller.settings import MpcConfig
from flexarm_controller.state import ArmState
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

BENCHMARKS = Path(__file__).resolve().parents[1] / "benchmarks"
ARMS = {
    "single_link": ("single_link", 0.4, (0.6,), 0.02),
    "variable_stiffness": ("variable_stiffness", 0.5, (0.5, -0.6, 0.4), 0.05),
    "two_link": (str(BENCHMARKS / "two_link.yaml"), 0.3, (0.5, 0.6), 0.02),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", ARMS)
def test_the_settled_program_has_ipopts_optimum(name: str) -> None:
    path, share, way, dt = ARMS[name]
    description = load_config(find_manipulator(path))
    tree, limits = ReducedTree(description), limits_of(description)
    limits = replace(limits, effort=share * limits.effort, effort_rate=share * limits.effort_rate)
    config = MpcConfig(horizon=10, blocks=(1, 1, 2, 2, 4), delay_periods=0, tip_error=0.01, slack_price=10.0)
    arm = NonlinearArm(description, NmpcConfig(), dt, 10)
    model = linearize(tree)
    law = NonlinearMpc(model, arm, limits, config, NmpcConfig(sqp_iterations=50))
    home, goal = np.array(description.home), np.array(description.home) + way
    still = np.zeros((2, home.size))
    reference = Reference(np.array([0.0, 8 * dt]), np.vstack([home, goal]), still, still)
    eta = np.zeros(model.n_eta)
    eta[0] = 0.02
    state = ArmState(0.0, model.model_id, home, eta, 0.5 * np.ones(home.size), -eta, 0.01 * limits.effort)
    plan = law.step(state, reference, 0.1 * limits.effort[None])
    assert plan.limits_active, "the case is too easy"

    ipopt = load_module(BENCHMARKS / "nmpc_by_ipopt.py").IpoptNmpc(
        law, tree, arm.coordinates, limits, config, dt
    )
    known = law.embed(state, 0.1 * limits.effort[None])
    assert known is not None
    torques, is_solved = ipopt.solve((known.s_0, known.d, known.before), law)
    assert is_solved
    blocks = plan.torques[[0, 1, 2, 4, 6]]
    np.testing.assert_allclose(blocks / limits.effort, torques / limits.effort, rtol=0, atol=1e-6)
