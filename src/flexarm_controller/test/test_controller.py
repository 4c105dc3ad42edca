"""The ladder: predictive control, the plan of before, joint damping, hold; limits on every rung."""

from dataclasses import replace

import numpy as np
import pytest
from served_arms import limits_of_hub, single_link, state_of, two_axes, two_axis_limits

from flexarm_controller.controller import Controller
from flexarm_controller.damping import JointDamping
from flexarm_controller.program.prediction import plant
from flexarm_controller.reference import hold
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_controller.solvers.qp import QpResult
from flexarm_controller.time_budget import Clocks

DT = 0.005
MODEL = single_link()
STILL = np.zeros(8)
MOVING = np.array([0.1, 1e-4, 0, 0, 1.0, 0, 0, 0])


def controller(law="mpc", **settings):
    return Controller(MODEL, limits_of_hub(), ControllerConfig(law=law, **settings))


class Stub:
    """A solver that answers what it is told to."""

    def __init__(self, x, solved):
        self.result = QpResult(np.full(23, x), "stubbed", 3, 1.0, solved)

    def solve(self, *vectors):
        return self.result


class NeverOpen:
    """A way around the solver that no state finds."""

    def look(self, z, added):
        return z[:0], -np.inf


def swap_solver(ladder, solver=None, interior=None):
    """Let a solver, which fails by default, answer every state; returns what stood there."""
    planner = ladder._laws.planner
    former = planner._solver, planner._interior
    planner._solver, planner._interior = solver or Stub(2.1e9, False), interior or NeverOpen()
    return former


def test_the_rungs_follow_each_other_and_name_the_reason():
    ladder = controller()
    first = ladder.step(state_of(MOVING, MODEL))
    assert (first.mode, first.reason) == ("mpc", "")
    swap_solver(ladder)
    commands = [ladder.step(state_of(MOVING, MODEL, k * DT)) for k in range(1, 8)]
    assert [c.mode for c in commands] == ["shifted_plan"] * 5 + ["lqr"] * 2
    assert all(c.reason == "solver: stubbed" for c in commands[:5])
    assert all(c.reason == "solver: stubbed; no earlier plan reaches here" for c in commands[5:])
    for k, command in enumerate(commands[:5], start=1):
        np.testing.assert_allclose(command.tau, first.plan[k], rtol=1e-12)
        np.testing.assert_array_equal(command.plan[0], first.plan[k])
    lost = replace(state_of(MOVING, MODEL, 0.1), usable=False, reason="lost")
    braking = ladder.step(lost)
    assert (braking.mode, braking.reason) == ("damping", "estimator: lost")
    at_rest = ladder.step(replace(state_of(STILL, MODEL, 0.105), usable=False, reason="lost"))
    assert (at_rest.mode, at_rest.reason) == ("hold", "estimator: lost")


def test_after_a_failure_the_next_good_solve_is_used_at_once():
    ladder = controller()
    ladder.step(state_of(MOVING, MODEL))
    good = swap_solver(ladder)
    assert ladder.step(state_of(MOVING, MODEL, DT)).mode == "shifted_plan"
    swap_solver(ladder, *good)
    assert ladder.step(state_of(MOVING, MODEL, 2 * DT)).mode == "mpc"


def test_a_thousand_failures_in_between_never_let_the_solvers_numbers_through():
    ladder = controller()
    bad = Stub(2.1e9, False), NeverOpen()
    good = swap_solver(ladder)
    for k in range(1000):
        swap_solver(ladder, *(bad if k % 2 else good))
        command = ladder.step(state_of(MOVING, MODEL, k * DT))
        assert command.mode == ("shifted_plan" if k % 2 else "mpc")
        assert abs(command.tau[0]) <= 28.0


@pytest.mark.parametrize(
    ("state", "reason"),
    [
        (replace(state_of(MOVING, MODEL), model_id="other"), "state belongs to model other"),
        (replace(state_of(MOVING, MODEL), usable=False, reason="lost"), "estimator: lost"),
        (replace(state_of(MOVING, MODEL), usable=False), "estimator: state is not usable"),
        (replace(state_of(MOVING, MODEL), d=np.array([np.nan])), "state is not finite"),
        (replace(state_of(MOVING, MODEL), eta=np.array([0, np.inf, 0])), "state is not finite"),
    ],
)
@pytest.mark.parametrize("law", ["mpc", "lqr"])
def test_a_state_that_cannot_be_used_brakes_with_the_reason(state, reason, law):
    command = controller(law).step(state)
    assert command.mode == "damping" and reason in command.reason
    assert np.isfinite(command.tau).all() and command.tau[0] <= 0.0


def test_a_state_of_another_model_says_which_side_is_behind():
    ladder = controller()
    other = replace(MODEL, D=2.0 * MODEL.D)
    ahead = ladder.step(replace(state_of(MOVING, MODEL), model_id=other.model_id))
    assert ahead.reason.endswith("the controller lacks it")
    ladder.adopt(other)
    behind = ladder.step(state_of(MOVING, MODEL))
    assert behind.reason.endswith("the estimator still uses the one before")
    assert MODEL.model_id in behind.reason and other.model_id in behind.reason


def test_a_velocity_that_is_not_a_number_gives_a_finite_torque():
    state = replace(state_of(MOVING, MODEL), theta_dot=np.array([np.nan]))
    assert np.isfinite(controller().step(state).tau).all()


def test_torque_and_rate_limits_hold_whatever_happens():
    rng = np.random.default_rng(1)
    limits = limits_of_hub(effort=1.0, effort_rate=30.0)
    ladder = Controller(MODEL, limits, ControllerConfig(), MpcConfig(time_limit=0.0))
    last = np.zeros(1)
    for k in range(400):
        x = rng.standard_normal(8) * np.array([1, 1e-3, 1e-4, 1e-5, 3, 0.03, 0.01, 0.01])
        state = state_of(x, MODEL, k * DT)
        if k % 7 == 0:
            state = replace(state, usable=False)
        tau = ladder.step(state).tau
        assert abs(tau[0]) <= 1.0 and abs(tau - last)[0] <= 30.0 * DT * (1 + 1e-12)
        last = tau


def test_without_a_reference_the_arm_is_held_where_it_is():
    ladder = controller()
    x = STILL.copy()
    x[0] = 0.7
    command = ladder.step(state_of(x, MODEL))
    assert command.mode == "mpc"
    np.testing.assert_allclose(command.tau, 0.0, atol=1e-9)
    np.testing.assert_allclose(command.tracking_error, 0.0, atol=1e-12)


def test_a_reference_outside_the_limits_is_not_taken():
    ladder = controller()
    ladder.step(state_of(STILL, MODEL))
    before = ladder.reference
    assert "joint limits" in ladder.follow(hold(np.array([5.0])))
    assert ladder.reference is before
    assert ladder.follow(hold(np.array([0.5]))) == ""


def test_what_the_axes_cannot_be_led_to_within_their_range_is_dropped_with_a_notice():
    ladder = controller()
    ladder.queue.take(
        hold(np.array([5.0]), 1.0), 0.0
    )  # by another way than `follow`, which looks at its ends
    command = ladder.step(state_of(STILL, MODEL))
    assert "reference dropped: on the way to it from where the axes are led: axis" in ladder.notice
    assert "beyond the limit 3 rad" in ladder.notice
    np.testing.assert_allclose(command.tracking_error, 0.0, atol=1e-12)
    ladder.step(state_of(STILL, MODEL, DT))
    assert ladder.notice == ""


def test_a_new_model_is_adopted_without_a_jump_of_torque():
    ladder = controller()
    ladder.follow(hold(np.array([0.3])))
    for k in range(20):
        last = ladder.step(state_of(STILL, MODEL, k * DT))
    other = single_link(frequency_scale=1.05)
    ladder.adopt(other)
    assert ladder.step(state_of(STILL, MODEL, 0.1)).mode in ("damping", "hold")  # state of the old model
    ladder.adopt(MODEL)
    assert abs(ladder.step(state_of(STILL, MODEL, 0.105)).tau - last.tau)[0] <= 2 * 2800.0 * DT


def test_lqr_brings_the_arm_to_its_reference_without_offset():
    ladder, system = controller("lqr"), plant(MODEL, DT)
    ladder.follow(hold(np.array([0.2])))
    x, d, acting = STILL.copy(), np.array([0.3]), np.zeros(1)
    for k in range(1500):
        command = ladder.step(state_of(x, MODEL, k * DT, d))
        assert command.mode == "lqr"
        x = system.A @ x + system.B @ (acting + d) + system.c
        acting = command.tau
    np.testing.assert_allclose(x, [0.2, *np.zeros(7)], atol=1e-6)
    np.testing.assert_allclose(acting, -d, atol=1e-6)


def test_joint_damping_brings_a_rigid_joint_to_rest_at_its_rate():
    damping = JointDamping(MODEL, 8.0, DT, 1)
    assert damping.step(np.array([2.0]))[0] == pytest.approx(-8.0 * MODEL.M[0, 0] * 2.0)


def test_joint_damping_holds_the_load_of_an_arm_at_its_pose():
    model = two_axes()
    system, damping = plant(model, DT), JointDamping(model, 8.0, DT, 1)
    rest = -np.linalg.solve(model.K[2:, 2:], model.f0[2:])  # deflection of the modes
    x = np.concatenate([model.pose, rest, np.zeros(5)])
    for _ in range(200):
        x = system.A @ x + system.B @ damping.step(x[5:7]) + system.c
    np.testing.assert_allclose(x, np.concatenate([model.pose, rest, np.zeros(5)]), atol=1e-9)


def test_an_arm_with_weight_is_taken_over_without_a_drop_of_its_torque():
    """The guard has held the load until now; the rate limit is far too small to catch up with it."""
    model, limits = two_axes(), two_axis_limits()
    slow = replace(limits, effort_rate=limits.effort_rate * 1e-3)
    arm = Controller(model, slow, ControllerConfig(), MpcConfig(delay_periods=2))
    rest = -np.linalg.solve(model.K[2:, 2:], model.f0[2:])
    x = np.concatenate([model.pose, rest, np.zeros(5)])
    load = JointDamping(model, 8.0, DT, 1).load
    assert abs(load).max() > 10.0 * (slow.effort_rate * DT).max()
    for _ in range(2):
        taus = [arm.step(state_of(x, model, k * DT)).tau for k in range(20)]
        np.testing.assert_allclose(taus, np.tile(load, (20, 1)), atol=2.0 * (slow.effort_rate * DT).max())
        arm.reset()


def test_joint_damping_calms_the_flexible_arm_with_its_delay():
    damping, system = JointDamping(MODEL, ControllerConfig().damping_rate, DT, 1), plant(MODEL, DT)
    x, acting = MOVING.copy(), np.zeros(1)
    for _ in range(600):
        x, acting = system.A @ x + system.B @ acting + system.c, damping.step(x[4:5])
    assert abs(x[4]) < ControllerConfig().rest_velocity


def test_joint_damping_of_a_light_motor_is_lowered_until_it_does_not_ring():
    """The rate that is right for the geared hub rang the light one up with three periods of delay."""
    light = replace(MODEL, M=MODEL.M - np.diag([0.99 * free_inertia(MODEL), 0, 0, 0]))
    damping, system = JointDamping(light, 8.0, DT, 3), plant(light, DT)
    assert damping.rate < 8.0 == JointDamping(MODEL, 8.0, DT, 1).rate
    assert grows(system, lambda v: -8.0 * light.M[0, 0] * v) > 10.0
    assert grows(system, damping.step) < 1.0


def free_inertia(model):
    """Return what the motor feels at once, its modes left behind."""
    return 1.0 / np.linalg.inv(model.M)[0, 0]


def grows(system, law):
    """Return by how much the velocity of a modes' kick grows within 3 s, three periods late."""
    x, coming = np.array([0.0, 0, 0, 0, 0, 1e-3, 0, 0]), [np.zeros(1)] * 3
    speeds = []
    for _ in range(600):
        x, coming = system.A @ x + system.B @ coming[0], [*coming[1:], law(x[4:5])]
        speeds.append(abs(x[4]))
    return max(speeds[500:]) / max(speeds[:100])


def test_the_command_says_what_it_took():
    clock = iter(np.arange(100) * 0.25)
    ladder = Controller(MODEL, limits_of_hub(), clocks=Clocks(cpu=lambda: float(next(clock))))
    command = ladder.step(state_of(MOVING, MODEL, 0.5))
    assert command.solve_time == 0.25 and command.t == 0.5
    assert command.model_id == MODEL.model_id and command.solver_status
    assert command.plan.shape == (40, 1)
