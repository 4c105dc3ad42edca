"""A step of the predictive controller: delay, offset, limits."""

from dataclasses import replace

import numpy as np
import pytest
from served_arms import limits_of_hub, single_link, state_of, two_axes, two_axis_limits

from flexarm_controller.local_law import Program
from flexarm_controller.mpc import Mpc
from flexarm_controller.program.prediction import plant
from flexarm_controller.reference import Reference, hold
from flexarm_controller.settings import MpcConfig
from flexarm_controller.solvers.qp import QpResult

DT = 0.005
FIRM = MpcConfig(
    position_error=0.02, velocity_error=0.09, modal_energy=1.4e-4, modal_cutoff_hz=14.0,
    input_acceleration=2.4, input_jerk=150.0, time_limit=0.0,
)  # fmt: skip


def run(model, limits, config, reference, steps, d=None, x=None):
    """Return states, torques and plans of a loop with perfect state and the delay of the settings."""
    system, mpc = plant(model, DT), Mpc(model, limits, config, DT)
    x = np.concatenate([model.xi0, np.zeros(model.n)]) if x is None else x
    d = np.zeros(model.n_theta) if d is None else d
    sent = np.zeros((max(config.delay_periods, 1), model.n_theta))
    states, torques, plans = [], [], []
    for k in range(steps):
        plan = mpc.step(state_of(x, model, k * DT, d), reference, sent)
        assert not plan.is_empty
        new = plan.torques[0]
        x = system.A @ x + system.B @ (sent[0] + d) + system.c
        sent = np.vstack([sent[1:], new])
        states.append(x)
        torques.append(new)
        plans.append(plan)
    return np.array(states), np.array(torques), plans


def step_to(goal, start=0.2):
    t = np.array([0.0, start, start + 0.4])
    theta = np.array([[0.0], [0.0], [goal]])
    return Reference(t, theta, np.zeros((3, 1)), np.zeros((3, 1)))


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_the_plan_comes_true_when_the_model_is_right_whatever_the_delay(delay):
    model = single_link()
    config = MpcConfig(horizon=20, blocks=(1,) * 20, delay_periods=delay)
    _, torques, plans = run(model, limits_of_hub(), config, hold(np.array([0.1])), 15)
    np.testing.assert_allclose(torques[:, 0], plans[0].torques[:15, 0], rtol=1e-6)


def test_an_unmodelled_torque_leaves_no_offset():
    model = two_axes()
    goal = model.pose + np.array([0.2, -0.1])
    limits = two_axis_limits(effort=(80.0, 80.0), strain=(50.0, 50.0))
    states, _, _ = run(model, limits, MpcConfig(time_limit=0.0), hold(goal), 1500, d=np.array([1.0, -0.5]))
    np.testing.assert_allclose(states[-1, :2], goal, atol=1e-6)
    np.testing.assert_allclose(states[-1, 5:], 0.0, atol=1e-6)


def test_the_joint_moves_before_the_reference_does():
    model = single_link()
    states, _, _ = run(model, limits_of_hub(), MpcConfig(), step_to(0.3, start=0.4), 80)
    at = np.arange(1, 81) * DT
    assert abs(states[at < 0.4 - 40 * DT, 0]).max() == 0.0  # nothing to be seen yet
    assert abs(states[at < 0.4, 0]).max() > 1e-4


@pytest.mark.parametrize("backend", ["osqp", "daqp"])
def test_torque_and_rate_limits_are_kept_and_named(backend):
    model, limits = single_link(), limits_of_hub(effort=0.5, effort_rate=10.0)
    config = replace(FIRM, backend=backend)
    states, torques, plans = run(model, limits, config, step_to(0.5), 400)
    assert abs(torques).max() <= 0.5 * (1 + 1e-4)
    assert abs(np.diff(torques[:, 0], prepend=0.0)).max() <= 10.0 * DT * (1 + 1e-3)
    named = {name for plan in plans for name in plan.limits_active}
    assert named == {"torque:base.rz", "rate:base.rz"}
    assert states[-1, 0] == pytest.approx(0.5, abs=1e-3)


@pytest.mark.parametrize("backend", ["osqp", "daqp"])
def test_strain_stays_below_its_limit_and_the_arm_still_arrives(backend):
    model, strain = single_link(), 2.8e-5
    free, _, _ = run(model, limits_of_hub(), MpcConfig(), step_to(0.5), 300)
    config = MpcConfig(backend=backend, time_limit=0.0)
    held, _, plans = run(model, limits_of_hub(strain=strain), config, step_to(0.5), 600)
    C = model.outputs.C_pos[1]
    assert abs(free[:, :4] @ C).max() > 1.5 * strain
    assert abs(held[:, :4] @ C).max() <= strain * 0.901  # margin of 10 %, tolerance of the solver
    assert "strain:root_strain.strain" in {name for plan in plans for name in plan.limits_active}
    assert held[-1, 0] == pytest.approx(0.5, abs=2e-3)


def test_a_strain_beyond_its_limit_is_brought_back_instead_of_refused():
    model = single_link()
    x = np.zeros(8)
    x[1] = 3e-3  # kg^0.5 m; 80 ustrain
    states, _, _ = run(
        model, limits_of_hub(strain=2e-5), MpcConfig(time_limit=0.0), hold(np.zeros(1)), 400, x=x
    )
    assert abs(states[-50:, :4] @ model.outputs.C_pos[1]).max() < 2e-5


def test_both_solvers_command_the_same_torque():
    model, limits = single_link("light_hub"), limits_of_hub("light_hub", effort=0.1, strain=2e-5)
    torques = [
        run(model, limits, MpcConfig(backend=backend, time_limit=0.0), step_to(0.4), 250)[1]
        for backend in ("osqp", "daqp")
    ]
    np.testing.assert_allclose(torques[0], torques[1], atol=1e-3 * 0.1)  # tolerance 1e-5, over 250 steps


def test_a_failed_solve_gives_an_empty_plan_and_the_next_good_one_a_full_one():
    model = single_link()
    mpc = Mpc(model, limits_of_hub(), MpcConfig(), DT)
    sent = np.zeros((1, 1))
    bad = replace(state_of(np.zeros(8), model), d=np.array([np.nan]))
    assert mpc.step(bad, hold(np.zeros(1)), sent).is_empty
    assert not mpc.step(state_of(np.zeros(8), model), hold(np.zeros(1)), sent).is_empty


def test_a_sag_that_is_told_no_more_is_forgotten():
    """The estimator tells as many deflections as it knows of; a model without any tells none."""
    model, reference, sent = single_link(), hold(np.zeros(1)), np.zeros((1, 1))
    state = state_of([0.0, 2e-3, 1e-3, *np.zeros(5)], model)
    used, new = (Mpc(model, limits_of_hub(), MpcConfig(time_limit=0.0), DT) for _ in range(2))
    sagging = used.step(replace(state, sag=np.array([2e-3, 1e-3])), reference, sent).torques
    found, expected = (mpc.step(state, reference, sent).torques for mpc in (used, new))
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert abs(sagging - expected).max() > 1e-3  # N m


def test_the_solver_does_not_start_from_a_plan_that_failed():
    class Solver:
        """Fails at will and remembers where it was told to start."""

        starts, solved = [], True

        def solve(self, q, l, u, warm, budget):  # noqa: E741
            self.starts.append(warm)
            return QpResult(np.ones(q.size), "", 1, 0.0, self.solved)

    model, solver = single_link(), Solver()
    mpc = Mpc(model, limits_of_hub(), MpcConfig(time_limit=0.0), DT)
    problem = mpc.problem
    gradient = np.zeros(problem.q_0.size)
    program = Program(problem.P, problem.rows.A, lambda known: problem.vectors(known, gradient))
    for solver.solved in (True, False, True):
        mpc.solve(solver, program, np.zeros(problem.known.now.stop))
    assert solver.starts[0] is None and solver.starts[1] is not None
    assert solver.starts[2] is None
