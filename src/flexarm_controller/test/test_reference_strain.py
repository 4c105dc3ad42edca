"""References that bend gauged strips too far: found with the vibration they stir, slowed down or refused."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from served_arms import limits_of_hub, single_link, two_axes, two_axis_limits
from test_arm_loads import Arm
from test_arm_loads import quintic as straight

from flexarm_controller.motion.admission import admit
from flexarm_controller.motion.excess import find_excess
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.motion.strains import strains_of
from flexarm_controller.motion.stretch import slow_down
from flexarm_controller.program.equilibrium import build_equilibrium
from flexarm_controller.reference import Reference, hold

ANGLE, SPEED, RAMP = 1.2, 5.9, 0.09  # rad, rad/s, s: within position, velocity and torque of the geared link


def dash(start=0.5):
    """A ramp of speed, a stretch at speed, a ramp down."""
    t = np.array([0.0, RAMP, ANGLE / SPEED, ANGLE / SPEED + RAMP])
    theta = np.array([0.0, SPEED * RAMP / 2, ANGLE - SPEED * RAMP / 2, ANGLE])
    return Reference.through(start + t, theta[:, None], np.array([[0.0], [SPEED], [SPEED], [0.0]]))


def integrated(model, reference, gauge):
    """Return the largest strain of the modes that ring while the axis follows exactly, by integration."""
    m, omega, zeta = model.n_theta, model.omega, model.zeta
    parts = [*zip(reference.t[:-1], reference.t[1:], strict=True), (reference.t[-1], reference.t[-1] + 0.2)]
    x, worst = np.zeros(2 * omega.size), 0.0
    for begin, end in parts:
        a = reference.sample(np.array([(begin + end) / 2]))[2][0]  # steady between the points
        push = -model.M[m:, :m] @ a

        def rate(t, x, push=push):
            eta, eta_dot = np.split(x, 2)
            return np.concatenate([eta_dot, push - 2 * zeta * omega * eta_dot - omega**2 * eta])

        t = np.linspace(begin, end, 501)
        found = solve_ivp(rate, (begin, end), x, t_eval=t, rtol=1e-6, atol=1e-8).y
        worst, x = max(worst, abs(model.outputs.C_pos[gauge, m:] @ found[: omega.size]).max()), found[:, -1]
    return worst


def peak(model, limits, reference, share=0.2, way=None):
    """Return the largest strain; looked for wherever it may be beyond a share of the limit."""
    strains = strains_of(model, replace(limits, strain=share * limits.strain), way)
    return float(abs(strains.peaks(reference)[1]).max())


def test_the_strain_of_a_reference_is_that_of_the_modes_it_makes_ring():
    model, limits = single_link(), limits_of_hub()
    steady = abs(model.outputs.C_pos[1, 1:] @ (model.M[1:, 0] / model.omega**2)) * SPEED / RAMP
    found = peak(model, limits, dash())
    assert found == pytest.approx(integrated(model, dash(), 1), rel=2e-3)  # 16 instants per fastest period
    assert 1.8 * steady < found < 2.0 * steady


def test_a_dash_of_the_shipped_arm_is_slowed_down_for_its_strain():
    """Under joint PD the guard stopped it at 1022 of 1000 ustrain."""
    arm = Arm("single_link")
    slowed, remark = admit(dash(), arm.model, arm.limits, MotionConfig(), loads=arm.loads)
    told = "gauge root_strain.strain: strain 1111 ustrain is beyond the limit 1000 ustrain at 0.092 s"
    assert remark == f"stretched in time by 1.527: {told}"
    still, ramp = np.zeros((1, 1)), np.full((1, 1), SPEED / RAMP)
    steady = strains_of(arm.model, arm.limits).steady.inertia(still, ramp)
    torque = build_equilibrium(arm.model).inertia(still, ramp)
    assert (abs(steady.item()), torque.item()) == pytest.approx((577e-6, 0.85 * 28.0), rel=0.01)
    assert peak(arm.model, arm.limits, slowed) < 1.001 * MotionConfig().motion_strain * arm.limits.strain[0]


@pytest.fixture
def scarce():
    """Return limits of the geared link that the dash keeps but for its strain, which is a tenth too large."""
    model, limits = single_link(), limits_of_hub()
    limits = replace(limits, strain=np.array([peak(model, limits, dash()) / 1.1]))
    assert find_excess(dash(), limits, model.theta_names, build_equilibrium(model)) is None
    return limits


@pytest.mark.parametrize("excess", ["retime", "stretch"])
def test_a_reference_that_only_bends_the_arm_too_far_is_slowed_down_by_name(scarce, excess):
    model, config = single_link(), MotionConfig(excess=excess)
    followed, remark = admit(dash(), model, scarce, config, is_awaited=True)
    factor = float(remark.split(" by ")[1].split(":")[0])
    limit = 1e6 * scarce.strain[0]
    told = f"strain -{1.1 * limit:.4g} ustrain is beyond the limit -{limit:.4g} ustrain at 0.0"
    assert f"gauge root_strain.strain: {told}" in remark
    assert followed.t[-1] - followed.t[0] == pytest.approx(factor * (dash().t[-1] - dash().t[0]), rel=1e-3)
    most = config.motion_strain * scarce.strain[0]
    assert (
        peak(model, scarce, followed) < 1.001 * most < peak(model, scarce, slow_down(dash(), factor / 1.02))
    )


def test_or_refused_or_told_if_asked(scarce):
    model = single_link()
    with pytest.raises(MotionError, match="^gauge root_strain.strain: strain .* is beyond the limit"):
        admit(dash(), model, scarce, MotionConfig(excess="refuse"))
    followed, remark = admit(dash(), model, scarce, MotionConfig(excess="tell"))
    assert remark.startswith("the law must bend the arm less than this would: gauge root_strain.strain")
    np.testing.assert_array_equal(followed.t, dash().t)


@pytest.mark.parametrize("excess", ["retime", "stretch", "tell", "refuse"])
def test_a_reference_just_within_the_strain_is_followed_as_it_is(scarce, excess):
    model, asked = single_link(), dash()
    inside = replace(scarce, strain=np.array([1.0001 * peak(model, scarce, asked)]))
    followed, remark = admit(asked, model, inside, MotionConfig(excess=excess))
    assert followed is asked and remark == ""


def test_what_is_slowed_down_for_torque_is_looked_at_for_strain_afterwards(scarce):
    model = single_link()
    limits = replace(scarce, effort=0.9 * abs(build_equilibrium(model).U[0, 2]) * np.array([SPEED / RAMP]))
    limits = replace(limits, strain=0.5 * limits.strain)
    followed, remark = admit(dash(), model, limits, MotionConfig())
    assert remark.index("axis base.rz: torque") < remark.index("gauge root_strain.strain: strain")
    equilibrium, strains = build_equilibrium(model), strains_of(model, limits)
    assert find_excess(followed, limits, model.theta_names, equilibrium, strains) is None
    with pytest.raises(
        MotionError, match="gauge root_strain.* while the guard is armed nothing is slowed down"
    ):
        admit(dash(), model, limits, MotionConfig(), is_awaited=True)


def test_strain_that_slowing_down_does_not_take_away_is_refused_by_gauge():
    """The weight alone bends it so far."""
    model, far = two_axes(), two_axis_limits(strain=(50.0, 50.0))
    strains = strains_of(model, far)
    rests = strains.peaks(hold(model.pose))[1][0]
    np.testing.assert_allclose(
        rests, (model.outputs.y0 + model.outputs.C_pos[:, 2:] @ (-model.f0[2:] / model.omega**2))[:2]
    )
    worst = int(abs(rests).argmax())
    tight = replace(far, strain=np.where(np.arange(2) == worst, 0.9 * abs(rests[worst]), 50.0))
    name = far.gauges[worst]
    with pytest.raises(MotionError, match=f"slowing down does not help: gauge {name}: strain"):
        admit(hold(model.pose), model, tight, MotionConfig())
    moved = Reference.through([0.0, 2.0], model.pose + np.array([[0.0, 0.0], [0.01, 0.01]]), np.zeros((2, 2)))
    with pytest.raises(MotionError, match=f"more than 10 times its time: gauge {name}: strain"):
        admit(moved, model, tight, MotionConfig())


def test_where_loads_change_on_the_way_strain_is_that_of_its_poses():
    arm = Arm("planar_3rrr")
    home = arm.model.pose
    asked = straight(home, home + 0.15, 0.35, count=21)
    way = arm.loads.along(asked, home)
    assert way is not None
    along = peak(arm.model, arm.limits, asked, way=way)
    assert along == pytest.approx(peak(arm.model, arm.limits, asked), rel=0.2)  # 0.15 rad from home
    tight = replace(arm.limits, strain=np.full(arm.limits.strain.size, along / 1.1))
    followed, remark = admit(asked, arm.model, tight, MotionConfig(), loads=arm.loads)
    assert followed.t[-1] > asked.t[-1] and "gauge " in remark
    with pytest.raises(MotionError, match="gauge .* a way on which weight and inertia change"):
        admit(asked, arm.model, tight, MotionConfig(), True, arm.loads)
