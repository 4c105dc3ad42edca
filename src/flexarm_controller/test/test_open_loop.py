"""Open-loop motions: ways and shapers, predicted vibration, best trapezoid, linear program."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from served_arms import limits_of_hub, single_link, two_axes, two_axis_limits

from flexarm_controller.open_loop.axis_motion import PacedMotion, SampledMotion, ShapedMotion, Way
from flexarm_controller.open_loop.best_trapezoid import best_trapezoid
from flexarm_controller.open_loop.rest_to_rest import RestToRest, fastest
from flexarm_controller.open_loop.vibration_left import VibrationLeft, Window
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_model.motion.profiles import Quintic, Trapezoid
from flexarm_model.motion.shapers import shape, zv, zvd

DT = 0.005  # s
ANGLE = np.radians(10.0)
STRAIGHT = Way(np.array([0.0, 1.0]), np.array([[0.0], [ANGLE]]))
PERIOD = 1 / 5.23  # s
WINDOW = Window(0.1, 2.1, 20.0)


def integrate(model, tau, x_0):
    """Return [xi; xi'] after torques (N, n_u) by Runge-Kutta on the second-order equation."""
    n = model.n

    def flow(_, x, torque):
        force = model.B @ torque - model.f0 - model.D @ x[n:] - model.K @ (x[:n] - model.xi0)
        return np.concatenate([x[n:], np.linalg.solve(model.M, force)])

    x = x_0
    for torque in tau:
        x = solve_ivp(flow, (0.0, DT), x, args=(torque,), method="DOP853", rtol=1e-9, atol=1e-12).y[:, -1]
    return x


@pytest.fixture(scope="module")
def plan():
    problem = RestToRest(single_link(), limits_of_hub(), np.zeros(1), np.array([ANGLE]), DT)
    return problem, fastest(problem, 100)


def test_fastest_torques_bring_an_independently_integrated_arm_to_rest(plan):
    problem, found = plan
    x = integrate(problem.model, found.tau, np.zeros(8))
    wanted = np.array([ANGLE, *np.zeros(7)])
    np.testing.assert_allclose(x, wanted, atol=1e-7)  # of the integrator and of the program
    np.testing.assert_allclose(found.x[-1], wanted, atol=1e-8)


def test_fastest_plan_keeps_every_limit_and_there_is_none_in_one_period_less(plan):
    problem, found = plan
    limits = problem.limits
    steps = np.diff(np.concatenate([[[0.0]], found.tau, [[0.0]]]), axis=0)
    assert abs(steps).max() <= limits.effort_rate[0] * DT * (1 + 1e-6)
    assert abs(found.tau).max() <= found.peak * limits.effort[0] * (1 + 1e-6) <= limits.effort[0] * (1 + 2e-6)
    strain = found.x[:, :4] @ problem.model.outputs.C_pos[1]
    assert abs(strain).max() <= limits.strain[0] * (1 + 1e-6)
    assert abs(found.x[:, 4]).max() <= limits.velocity[0]
    assert problem.solve(len(found.tau) - 1) is None


def test_arm_whose_modes_do_not_feel_the_hub_is_as_fast_as_bang_bang():
    coupled = single_link()
    M = np.diag(np.diag(coupled.M))
    limits = limits_of_hub(effort=2.0, strain=np.inf, effort_rate=1e6)
    problem = RestToRest(replace(coupled, M=M), limits, np.zeros(1), np.array([ANGLE]), DT)
    rigid = 2 * np.sqrt(ANGLE * M[0, 0] / 2.0)  # s
    assert rigid <= fastest(problem, 200).duration <= rigid + 2 * DT  # whole periods on both sides
    assert problem.solve(200).peak * 2.0 == pytest.approx(4 * ANGLE * M[0, 0], rel=1e-6)  # in 1 s


@pytest.mark.parametrize(("name", "far"), [("velocity", 5.0), ("effort_rate", 1e6)])
def test_a_limit_that_is_open_is_one_that_is_not_reached(plan, name, far):
    """No limit of velocity is what a description without one means."""
    problem, _ = plan
    found, bounded = (
        replace(problem, limits=replace(problem.limits, **{name: np.array([value])})).solve(60)
        for value in (np.inf, far)
    )
    assert found.peak == pytest.approx(bounded.peak, rel=1e-6)  # of the program
    assert abs(problem.missed(found)).max() < 1e-8


def test_a_plan_begins_and_ends_with_what_holds_the_arm():
    """Under gravity the motors hold already, and go on holding: the rate counts from there."""
    model, limits = two_axes(), two_axis_limits()
    way = np.array([[0.3, -0.2], [0.5, 0.1]])
    found = RestToRest(model, limits, *way, DT).solve(200)
    rest = build_equilibrium(model)
    start, goal = (rest.U[:, :2] @ theta + rest.u_0 for theta in way)
    steps = np.diff(np.vstack([start, found.tau, goal]), axis=0)
    assert all((abs(load) > limits.effort_rate * DT / 2).any() for load in (start, goal))
    assert (abs(steps) <= limits.effort_rate * DT * (1 + 1e-6)).all()
    np.testing.assert_allclose(found.x[[0, -1], :2], way, atol=1e-7)


def test_torque_that_is_scarce_costs_time(plan):
    problem, found = plan
    strong = fastest(replace(problem, limits=limits_of_hub(strain=1.0)), 100)
    weak = fastest(replace(problem, limits=limits_of_hub(effort=0.56)), 200)
    assert strong.duration <= found.duration < weak.duration
    assert fastest(replace(problem, limits=limits_of_hub(effort=0.56)), 20) is None


def test_prediction_of_what_is_left_is_that_of_an_integrated_arm():
    model = single_link()
    motion = PacedMotion(STRAIGHT, Trapezoid(1.0, 1.0, 0.7, 0.1))
    velocity = motion.sample(np.arange(201) * DT)[1][:, 0]

    def flow(_, x, push):
        return np.concatenate([x[3:], -model.M[1:, 0] * push - 2 * model.zeta * model.omega * x[3:]
                               - model.omega**2 * x[:3]])  # fmt: skip

    x = np.zeros(6)
    for push in np.diff(velocity) / DT:
        x = solve_ivp(flow, (0.0, DT), x, args=(push,), method="DOP853", rtol=1e-9, atol=1e-13).y[:, -1]
    after = solve_ivp(
        flow, (0.0, 2.1), x, args=(0.0,), method="DOP853", rtol=1e-8, t_eval=np.linspace(0.1, 2.1, 20001)
    )
    push = -2 * model.zeta * model.omega * after.y[3:].T - model.omega**2 * after.y[:3].T
    measured = np.sqrt(np.mean((push[:, :1] * model.outputs.C_pos[3, 1]) ** 2))
    # only the first mode counts below 20 Hz; damping and the window's ends are worth 1 %
    assert VibrationLeft(model, WINDOW, DT).rms(motion) == pytest.approx(measured, rel=0.02)


def test_what_still_moves_at_the_last_period_is_stopped_there():
    """A motion that ends between two periods is the same as one that stops at the end of the last."""
    left, t = VibrationLeft(single_link(), WINDOW, DT), DT * np.arange(61)
    theta_dot = np.where(t < 0.299, 0.1, 0.0)[:, None]  # stops at the 60th
    still_moving = SampledMotion(DT, np.cumsum(theta_dot, axis=0) * DT, np.full_like(theta_dot, 0.1))
    stopped = SampledMotion(DT, still_moving.theta, theta_dot)
    assert left.rms(still_moving) == pytest.approx(left.rms(stopped), rel=1e-9)


def test_prediction_says_what_shapers_are_for():
    left = VibrationLeft(single_link(), WINDOW, 1e-3)
    worst = PacedMotion(STRAIGHT, Trapezoid.published("A", 1.0, PERIOD))
    plain = left.rms(worst)
    off = VibrationLeft(single_link(), WINDOW, 1e-3, frequency_scale=1.1)
    by_name = {make: ShapedMotion(worst, make(2 * np.pi * 5.23, 0.015)).stretched(1.0) for make in (zv, zvd)}
    assert all(left.rms(motion) < 2e-3 * plain for motion in by_name.values())
    assert off.rms(by_name[zvd]) < off.rms(by_name[zv]) < 0.3 * plain


def test_best_trapezoid_beats_all_published_ones_also_in_closed_form():
    left = VibrationLeft(single_link(), WINDOW, DT)

    def cost(trapezoid):
        return left.rms(PacedMotion(STRAIGHT, trapezoid))

    def closed_form(t):  # jumps of the acceleration at the corners, seen by the first mode without sampling
        pole = 2 * np.pi * 5.23 * (0.015 + 1j * np.sqrt(1 - 0.015**2))
        jumps = np.array([1 / t.t_a, -1 / t.t_a, -1 / t.t_d, 1 / t.t_d]) * t.omega_max
        return abs(jumps @ np.exp(pole * np.array([0.0, t.t_a, t.t_m - t.t_d, t.t_m])))

    best = best_trapezoid(1.0, cost, lambda _: True)
    published = [Trapezoid.published(case, 1.0, PERIOD) for case in "ABCDE"]
    for measure in (cost, closed_form):
        assert all(measure(best) < 0.2 * measure(trapezoid) for trapezoid in published)
    assert best == best_trapezoid(1.0, cost, lambda _: True)


def test_best_trapezoid_keeps_what_is_allowed():
    best = best_trapezoid(1.0, lambda t: abs(t.t_a - 0.1), lambda t: t.t_a >= 0.3)
    assert best.t_a == pytest.approx(0.3, abs=0.01)
    long = best_trapezoid(4.0, lambda t: abs(t.t_a - 0.7) + abs(t.t_d - 1.3), lambda _: True)
    assert (long.t_a, long.t_d) == pytest.approx((0.7, 1.3), abs=1e-3)  # on the finer grids
    with pytest.raises(ValueError, match="no trapezoid of 1 s"):
        best_trapezoid(1.0, lambda _: 0.0, lambda _: False)


@pytest.mark.parametrize("shaper", [None, zvd(30.0, 0.05)])
def test_velocity_and_acceleration_are_derivatives_on_a_bent_way(shaper):
    share = np.linspace(0.0, 1.0, 30)
    way = Way(share, np.stack([np.sin(3 * share), share**2], axis=1))
    motion = PacedMotion(way, Quintic(1.0, 0.8))
    motion = ShapedMotion(motion, shaper) if shaper else motion
    t, h = np.linspace(0.05, 0.7, 14), 1e-5
    theta, theta_dot, theta_ddot = motion.sample(t)
    before, after = motion.sample(t - h), motion.sample(t + h)
    np.testing.assert_allclose(theta_dot, (after[0] - before[0]) / (2 * h), atol=1e-7)
    np.testing.assert_allclose(theta_ddot, (after[1] - before[1]) / (2 * h), atol=1e-5)
    np.testing.assert_allclose(
        motion.sample(np.array([motion.duration]))[0][0], [np.sin(3.0), 1.0], atol=1e-12
    )


def test_shaping_the_axes_on_a_straight_way_is_shaping_the_profile():
    profile, shaper = Trapezoid(1.0, 0.6, 0.2, 0.1), zv(33.0, 0.02)
    t = np.linspace(-0.1, 1.0, 23)
    of_axes = ShapedMotion(PacedMotion(STRAIGHT, profile), shaper).stretched(0.9).sample(t)
    of_profile = shape(profile, shaper).stretched(0.9).sample(t)
    for axes, share in zip(of_axes, of_profile, strict=True):
        np.testing.assert_allclose(axes[:, 0], ANGLE * share, atol=1e-12)
    with pytest.raises(ValueError, match="ZV takes"):
        ShapedMotion(PacedMotion(STRAIGHT, profile), shaper).stretched(0.05)


def test_sampled_motion_goes_through_its_samples_and_rests_outside(plan):
    _, found = plan
    motion = SampledMotion(DT, found.x[:, :1], found.x[:, 4:5])
    t = np.arange(len(found.x)) * DT
    theta, theta_dot, _ = motion.sample(t)
    np.testing.assert_allclose(theta, found.x[:, :1], atol=1e-12)
    np.testing.assert_allclose(theta_dot, found.x[:, 4:5], atol=1e-9)
    _, rate, push = motion.sample(np.array([-1.0, 9.0]))
    np.testing.assert_allclose([*rate.ravel(), *push.ravel()], 0.0, atol=1e-6)
    slow, factor = motion.stretched(2.0), 2.0 / motion.duration
    assert slow.sample(np.array([2.0]))[0][0, 0] == pytest.approx(ANGLE, abs=1e-8)
    np.testing.assert_allclose(slow.sample(t * factor)[1], theta_dot / factor, atol=1e-9)
