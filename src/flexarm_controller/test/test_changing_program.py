"""The program whose matrices change: conditions of an optimum, warm starts, dependence, failure, recovery."""

import daqp
import numpy as np
import pytest

from flexarm_controller.nonlinear.changing_program import SLACK_CURVATURE, ChangingProgram

BLOCKS, N_U, N_O = 6, 2, 3
N_V, N_Y, PRICE = BLOCKS * N_U, BLOCKS * N_O, 2.0


def make(cap=500, step=0.7):
    bounds = (np.array([-1.0, -np.inf, -1.0]), np.array([1.0, 1.0, np.inf]))
    return ChangingProgram(np.full(N_U, step), BLOCKS, bounds, PRICE, cap)


def draw(rng, size=3.0):
    """Return Hessian, rows (each block feels only the torques until it), gradient, outputs, torque before."""
    half = rng.standard_normal((N_V, N_V))
    rows = rng.standard_normal((N_Y, N_V))
    for b in range(BLOCKS):
        rows[b * N_O : (b + 1) * N_O, (b + 1) * N_U :] = 0.0
    H = half @ half.T / N_V + 0.1 * np.eye(N_V)
    return H, rows, size * rng.standard_normal(N_V), rng.standard_normal(N_Y), rng.uniform(-0.9, 0.9, N_U)


def dense(H, rows, q, outputs, before, step=0.7):
    """Return the whole program as matrices, limits in the documented order: P, q, A, l, u."""
    P = np.block([[H, np.zeros((N_V, N_O))], [np.zeros((N_O, N_V)), SLACK_CURVATURE * np.eye(N_O)]])
    relax, first = np.tile(np.eye(N_O), (BLOCKS, 1)), np.r_[before, np.zeros(N_V - N_U)]
    rates = np.hstack([np.eye(N_V) - np.eye(N_V, k=-N_U), np.zeros((N_V, N_O))])
    A = np.vstack([np.eye(N_V + N_O), rates, np.hstack([rows, -relax]), np.hstack([rows, relax])])
    low, high = np.tile([-1.0, -np.inf, -1.0], BLOCKS), np.tile([1.0, 1.0, np.inf], BLOCKS)
    none, wide = np.full(N_Y, np.inf), np.full(N_O, np.inf)
    lower = np.concatenate([-np.ones(N_V), np.zeros(N_O), first - step, -none, low - outputs])
    upper = np.concatenate([np.ones(N_V), wide, first + step, high - outputs, none])
    return P, np.append(q, np.full(N_O, PRICE)), A, lower, upper


def assert_optimal(program, data, result):
    P, q, A, lower, upper = dense(*data)
    y, rows = A @ result.x, A[program.active]
    assert max((y - upper).max(), (lower - y).max()) < 1e-8
    gradient = P @ result.x + q
    multipliers = np.linalg.lstsq(rows.T, -gradient, rcond=None)[0]
    assert np.linalg.norm(gradient + rows.T @ multipliers) < 1e-8
    side = np.where(abs(y - upper)[program.active] < 1e-7, 1.0, -1.0)
    assert (side * multipliers > -1e-8).all()


def test_answers_satisfy_the_conditions_of_an_optimum_however_the_program_changes():
    rng, program, binding = np.random.default_rng(1), make(), set()
    for _ in range(300):
        data = draw(rng)
        assert program.prepare(*data[:2])
        result = program.solve(*data[2:])
        assert result.solved and result.status == "solved"
        assert_optimal(program, data, result)
        binding |= set(program.active.tolist())
    kinds = [slice(0, N_V), slice(N_V, N_V + N_O), slice(N_V + N_O, 2 * N_V + N_O)]
    assert all(binding & set(range(kind.start, kind.stop)) for kind in kinds)
    assert max(binding) >= 2 * N_V + N_O + N_Y  # outputs at both sides


def test_it_agrees_with_another_solver():
    rng, program = np.random.default_rng(2), make()
    for _ in range(50):
        data = draw(rng)
        program.prepare(*data[:2])
        P, q, A, lower, upper = dense(*data)
        expected = daqp.solve(P, q, A[N_V + N_O :], upper, lower)[0]
        np.testing.assert_allclose(program.solve(*data[2:]).x, expected, atol=1e-6)


def test_the_same_program_again_needs_no_change_of_the_active_set():
    data, program = draw(np.random.default_rng(3)), make()
    for expected in (False, True):
        program.prepare(*data[:2])
        assert (program.solve(*data[2:]).iterations == 0) == expected


def test_limits_that_say_the_same_do_no_harm():
    rng, program = np.random.default_rng(4), make()
    for _ in range(50):
        H, rows, q, outputs, before = draw(rng)
        rows[N_O:] = np.tile(rows[:N_O], (BLOCKS - 1, 1))
        outputs[:] = np.tile(outputs[:N_O], BLOCKS)
        program.prepare(H, rows)
        result = program.solve(q, outputs, before)
        assert result.solved
        P, gradient, A, lower, upper = dense(H, rows, q, outputs, before)
        expected = daqp.solve(P, gradient, A[N_V + N_O :], upper, lower)[0]
        np.testing.assert_allclose(result.x, expected, atol=1e-6)


def test_what_cannot_be_kept_is_never_called_solved():
    program = make(step=0.2)
    data = draw(np.random.default_rng(5))
    program.prepare(*data[:2])
    result = program.solve(data[2], data[3], np.array([1.5, 0.0]))  # out of reach of the torque limit
    assert not result.solved and "infeasible" in result.status
    program.prepare(*data[:2])
    assert program.solve(*data[2:]).solved


def test_another_solver_has_the_second_attempt_when_the_first_is_cut_short():
    data, program = draw(np.random.default_rng(6)), make(cap=1)
    program.prepare(*data[:2])
    result = program.solve(*data[2:])
    assert result.solved and "after too many changes" in result.status
    full = make()
    full.prepare(*data[:2])
    np.testing.assert_allclose(result.x, full.solve(*data[2:]).x, atol=1e-6)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_bad_numbers_are_refused_and_forgotten(bad):
    rng, program = np.random.default_rng(7), make()
    for place in range(5):
        data = draw(rng)
        spoilt = [np.array(part) for part in data]
        spoilt[place].flat[-1] = bad
        is_sound = program.prepare(*spoilt[:2])
        assert not (is_sound and program.solve(*spoilt[2:]).solved)
        assert program.prepare(*data[:2])
        result = program.solve(*data[2:])
        assert result.solved
        assert_optimal(program, data, result)


def test_an_arm_without_limited_outputs_has_torques_alone():
    program = ChangingProgram(np.full(N_U, 0.7), BLOCKS, (np.zeros(0), np.zeros(0)), PRICE, 500)
    H, _, q, _, before = draw(np.random.default_rng(8))
    assert program.prepare(H, np.zeros((0, N_V)))
    result = program.solve(q, np.zeros(0), before)
    assert result.solved
    assert abs(result.x).max() <= 1 + 1e-8


@pytest.mark.parametrize("cap", [100, 2])
def test_limits_that_bind_are_told_whoever_has_found_the_answer(cap):
    """Where the other solver had helped, none was: a plan at all its limits named no limit."""
    program = ChangingProgram(np.full(2, 2.0), 3, (np.array([-1e6]), np.array([1e6])), 10.0, cap)
    program.prepare(np.eye(6), np.zeros((3, 6)))
    for gradient, bound in ((-50.0, 6), (-0.5, 0)):
        result = program.solve(np.full(6, gradient), np.zeros(3), np.zeros(2))
        assert result.solved
        assert (set(program.active.tolist()) - {6}) == set(range(bound))  # 6 is the slack's own
