"""The guard's limits follow from the description, for every arm by the same code."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from served_arms import single_link

from flexarm_controller.guard import ARMED, Guard, GuardCommand, GuardState
from flexarm_controller.guard_settings import GuardSettings, gauges_of, guard_limits, hold_of
from flexarm_controller.guarding import pose_loads
from flexarm_controller.guarding.derive import all_at_once
from flexarm_controller.guarding.hold_rate import FINENESS, HoldRate, largest_hold_rate, spectral_radius
from flexarm_controller.guarding.loads import Loads
from flexarm_controller.guarding.pose_loads import PoseLoads, loads_of
from flexarm_controller.limits import limits_of
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import PoseError, linearize
from flexarm_model.settings.parameters import ParameterError
from flexarm_model.settings.strict_yaml import ConfigError
from flexarm_model.tree.reduced_tree import ReducedTree

MACHINES = ("single_link", "variable_stiffness", "planar_3rrr", "spatial_3tpt", "serial_6r")
SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in MACHINES[2:]]
SETTINGS = GuardSettings()


@cache
def tree_of(name):
    return ReducedTree(load_config(find_manipulator(name)))


@cache
def guarded(name, settings=SETTINGS):
    tree = tree_of(name)
    return guard_limits(tree.config, tree, settings)


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("single_link", ("axis 1 (base.rz)", "rad")),
        pytest.param("spatial_3tpt", ("axis 1 (drive_1.tx)", "m"), marks=pytest.mark.slow),
    ],
)
def test_the_guard_calls_axes_as_the_description_does(name, label):
    assert guarded(name).labels[0] == label


@pytest.mark.parametrize("name", [*MACHINES[:2], *SLOW])
def test_every_arm_gets_limits_that_its_motors_can_keep(name):
    """A stop at the planned deceleration takes no more torque than its share, wherever the arm is."""
    limits, described = guarded(name), limits_of(tree_of(name).config)
    np.testing.assert_array_equal(limits.effort, described.effort)
    np.testing.assert_array_equal(limits.effort_rate, described.effort_rate)
    np.testing.assert_array_equal(limits.strain, described.strain)
    np.testing.assert_allclose(limits.velocity, 1.2 * described.velocity, rtol=1e-12)  # rounding
    inertia = np.diag(limits.loads.inertia)
    braking = limits.braking
    for known, a, peak in zip(limits.ranges, braking.deceleration, braking.peak, strict=True):
        assert 0.0 < a <= known.deceleration < peak == 2.0 * known.deceleration and known.margin > 0.0
    torque = inertia * [known.deceleration for known in limits.ranges]
    assert (torque <= 0.5 * (1.0 + 1e-9) * described.effort).all()  # rounding
    assert limits.loads.fits(len(described.effort)) and 0.0 < limits.energy < math.inf


@pytest.mark.parametrize("name", [*MACHINES[:2], *SLOW])
def test_all_axes_may_brake_at_once(name):
    """Whatever the signs, at home and at the named poses; counting M_ii alone serial_6r asks twice that."""
    limits, tree = guarded(name), tree_of(name)
    for pose in (tree.config.home, *tree.config.poses.values()):
        loads = loads_of(tree, linearize(tree, np.array(pose)))
        asked = abs(np.array(loads.inertia)) @ limits.braking.deceleration + abs(np.array(loads.holding))
        assert (asked <= np.array(limits.effort) * (1.0 + 1e-9)).all()  # rounding


def loads_by_hand(inertia, holding):
    nothing = (0.0,) * len(holding)
    rows = (nothing,) * len(holding)
    return Loads(nothing, holding, rows, inertia, turning=rows, slowing=rows, reach=nothing, fastest=nothing)


def test_axes_that_ask_too_much_of_a_motor_give_way_alike():
    """Motor 2 has 6 of 10 N m left; 0.1, 2 and 4 N m are asked of it: axes 2 and 3 keep 5.9 of 6."""
    coupled = loads_by_hand(((1.0, 0.1, 0.0), (0.1, 2.0, 4.0), (0.0, 4.0, 20.0)), (0.0, -4.0, 0.0))
    held = loads_by_hand(coupled.inertia, (0.0, -10.0, 0.0))  # nothing is left: no deceleration would do
    effort, a = np.array([10.0, 10.0, 100.0]), np.array([1.0, 1.0, 1.0])
    np.testing.assert_allclose(all_at_once(a, [held, coupled], effort), [1.0, 5.9 / 6.0, 5.9 / 6.0])
    assert all_at_once(a, [held], effort) is a
    np.testing.assert_array_equal(all_at_once(0.9 * a, [coupled], effort), 0.9 * a)


def test_the_numbers_of_a_single_link_are_those_by_hand():
    """0.3 kg m^2 and a rod with a point mass, 28 N m at 2800 N m/s, 6 rad/s, 200 Hz."""
    limits = guarded("single_link")
    strip = 0.63 * 0.0032 * 0.02 * 7750.0
    inertia = 0.3 + strip * (0.63**2 / 12.0 + 0.325**2) + 0.054 * 0.63**2
    (known,) = limits.ranges
    assert known.deceleration == pytest.approx(14.0 / inertia, rel=1e-3)
    assert known.margin == pytest.approx(known.deceleration * (7 * 0.005 + 42.0 / 2800.0) / 2.0)
    assert limits.braking.deceleration[0] == pytest.approx(6.0 / 16.0 / (0.02 + 21.0 / 2800.0))
    assert limits.energy == pytest.approx(2.0 * inertia * 36.0 / 2.0, rel=1e-3)
    assert limits.braking.taper == pytest.approx(50.0) and limits.braking.lead == pytest.approx(0.01)


def test_what_positions_and_velocities_may_differ_by_is_that_of_encoders_and_offset():
    """20 urad of the link's encoder, 30 of them, and 0.01 rad/s for 250 ms; delays of ten milliseconds."""
    assert guarded("single_link").noise == pytest.approx((30.0 * 20e-6 + 0.0025,))
    assert guarded("single_link").velocity_delay == 0.01
    tree = tree_of("single_link")
    blind = replace(tree.config, rate_hz=100.0, sensors=())
    wished = replace(SETTINGS, position_noise=5.0, velocity_offset=0.02, velocity_delay=0.005)
    for config, settings, noise, delay in (
        (blind, SETTINGS, 0.0025, 0.02),
        (blind, wished, 0.005, 0.02),
        (tree.config, wished, 5.0 * 20e-6 + 0.005, 0.01),
    ):
        limits = guard_limits(config, tree, settings)
        assert (limits.noise, limits.velocity_delay) == (pytest.approx((noise,)), delay)


def test_a_gauge_that_bears_little_makes_braking_gentler():
    """Static strain of a strip whose root is accelerated, E I kappa = sum m x a, at 5 mm from the clamp."""
    tree = tree_of("single_link")
    sensors = tuple(replace(spec, limit=min(spec.limit, 1e-4)) for spec in tree.config.sensors)
    limits = guard_limits(replace(tree.config, sensors=sensors), tree, SETTINGS)
    mu, length, from_axis, at = 0.0032 * 0.02 * 7750.0, 0.63, 0.01, 0.005
    x = np.linspace(at, length, 20001)
    moment = np.trapezoid(mu * (x - at) * (x + from_axis), x) + 0.054 * (0.62 - at) * (0.62 + from_axis)
    strain = 0.0016 * moment / (208.5e9 * 0.02 * 0.0032**3 / 12.0)
    assert limits.ranges[0].deceleration == pytest.approx(1e-4 / 2.0 / strain, rel=0.02)
    assert limits.strain == (1e-4,)


def test_a_gauge_that_the_arms_own_weight_strains_beyond_its_limit_keeps_the_guard_from_starting():
    """Strain of a level strip at 5 mm from the clamp under its weight, y M / E I, by hand."""
    config = load_config(find_manipulator("single_link"))
    level = replace(config, gravity=np.array([0.0, -9.81, 0.0]))
    mu, length, at = 0.0032 * 0.02 * 7750.0, 0.63, 0.005
    moment = 9.81 * (mu * (length - at) ** 2 / 2.0 + 0.054 * (0.62 - at))
    strain = 0.0016 * moment / (208.5e9 * 0.02 * 0.0032**3 / 12.0)
    for share, fits in ((1.1, True), (0.9, False)):
        sensors = tuple(replace(spec, limit=min(spec.limit, share * strain)) for spec in level.sensors)
        sagging = replace(level, sensors=sensors)
        if fits:
            assert guard_limits(sagging, ReducedTree(sagging), SETTINGS).gauges == ("root_strain",)
            continue
        with pytest.raises(
            ConfigError,
            match=r"sensors\.root_strain\.limit: the guard stops above \d+.* ustrain, the weight .* at home",
        ):
            guard_limits(sagging, ReducedTree(sagging), SETTINGS)


def test_the_loads_of_an_arm_with_weight_are_those_of_its_gravity():
    """Lever arms by hand: links 2 and 3 stretched out level, springs rigid enough to neglect their sag."""
    tree = tree_of("variable_stiffness")
    loads = loads_of(tree, linearize(tree, np.array([0.0, 0.0, 0.0])))
    elbow = 0.14752 * 9.81 * (0.24 - 0.115)
    shoulder = elbow + 9.81 * (0.14752 * 0.29 + 0.215 * (0.29 - 0.133))
    np.testing.assert_allclose(loads.holding, [0.0, shoulder, elbow], rtol=0.01, atol=1e-9)
    upright = loads_of(tree, linearize(tree))
    np.testing.assert_allclose(upright.holding, 0.0, atol=1e-9)
    assert upright.stiffness[1][1] == pytest.approx(-shoulder, rel=0.05)  # falls over


def test_new_loads_come_only_when_the_arm_has_moved_far_enough():
    follow = PoseLoads(tree_of("variable_stiffness"), FREE)
    home = np.array(tree_of("variable_stiffness").config.home)
    assert follow.look(home + 0.08) is None
    loads = follow.look(home + [0.0, -0.5, 0.0])
    assert loads is not None and loads.pose == pytest.approx(home + [0.0, -0.5, 0.0])
    assert follow.look(home + [0.0, -0.45, 0.0]) is None
    assert follow.look(home * math.nan) is None
    beyond = follow.look(home + [0.0, 99.0, 0.0])
    assert beyond is not None and beyond.pose[1] == pytest.approx(math.pi)  # the end of its range


@pytest.mark.parametrize("name", ["single_link", "variable_stiffness"])
def test_an_arm_without_velocity_limits_has_no_limit_of_energy_and_runs(name):
    """That is the default of a description; what its other limits are is finite all the same."""
    bounded = load_config(find_manipulator(name))
    joints = tuple(
        replace(joint, axes=tuple(replace(axis, velocity=math.inf) for axis in joint.axes))
        for joint in bounded.joints
    )
    open_ended = replace(bounded, joints=joints)
    limits = guard_limits(open_ended, ReducedTree(open_ended), SETTINGS)
    assert limits.energy == math.inf and all(map(math.isfinite, limits.braking.deceleration))
    guard, count = Guard(limits), len(limits.effort)
    assert guard.arm(0.0, 1)
    state = GuardState((5.0,) * count, tuple(open_ended.home))
    guard.step(GuardCommand(0.0, 1, 1, limits.loads.holding), state, limits.period)
    assert guard.mode == ARMED, guard.reason


def test_where_the_arm_cannot_stand_there_are_no_new_loads(monkeypatch):
    def falls(tree, pose):
        raise PoseError("no stable equilibrium")

    follow = PoseLoads(tree_of("variable_stiffness"), FREE)
    monkeypatch.setattr(pose_loads, "linearize", falls)
    assert follow.look(np.array([1.0, 1.0, 1.0])) is None


FREE = HoldRate(0.005, 0.4, 1.0)  # for loads alone


def test_where_the_arm_would_ring_up_it_is_held_more_softly():
    """Held with the rate of its home the 3RRR tore its loops apart at this pose, "stopped"."""
    limits, tree = guarded("planar_3rrr"), tree_of("planar_3rrr")
    pose = np.array([1.188, 1.651, 0.838])
    model, home, gain = linearize(tree, pose), limits.braking.rate, SETTINGS.braking_gain
    assert spectral_radius(model, limits.period, home) > 1.05
    loads = PoseLoads(tree, hold_of(limits, SETTINGS)).look(pose.tolist())
    assert 0.1 * home < loads.rate < 0.2 * home
    assert spectral_radius(model, limits.period, loads.rate / gain) < 1.0


def test_the_hold_rate_is_the_edge_of_stability():
    model = single_link()
    rate = largest_hold_rate(model, 0.005)
    assert spectral_radius(model, 0.005, rate) < 1.0 <= spectral_radius(model, 0.005, rate / FINENESS)


def test_drives_that_smooth_more_hold_an_arm_less_firmly():
    """As r is told in the guard's table, with a filter of the drives that is four times as slow."""
    firm, soft = (
        guarded("single_link", replace(SETTINGS, velocity_smoothing=share)).braking.rate
        for share in (0.4, 0.1)
    )
    assert soft < 0.8 * firm


@pytest.mark.parametrize("s", [0.1, 0.4, 1.0])
def test_a_rigid_axis_is_held_up_to_the_rate_that_its_poles_allow(s):
    """z^2 (z - 1)^2 (z - 1 + s) with damping r w and spring r^2 / 4 on a double integrator, in z."""
    model = single_link()
    rigid = replace(
        model,
        M=np.array([[2.0]]),
        D=np.zeros((1, 1)),
        K=np.zeros((1, 1)),
        B=np.eye(1),
        f0=np.zeros(1),
        omega=np.zeros(0),
        zeta=np.zeros(0),
        outputs=model.outputs,
        Phi=model.Phi[:, :1],
    )
    g = 0.2  # r T
    z = np.poly1d([1.0, 0.0])
    velocity = s * z * (z - 1.0)  # over z (z - 1 + s), of theta / T
    plant = 0.5 * (z + 1.0)  # over (z - 1)^2, of u T^2
    spring = g**2 / 4.0 * z * (z - 1.0 + s)
    whole = z * (z - 1.0) ** 2 * z * (z - 1.0 + s) + plant * (g * velocity + spring)
    assert spectral_radius(rigid, 0.005, g / 0.005, s) == pytest.approx(abs(whole.roots).max(), rel=1e-9)


def test_the_gauges_of_a_description_are_in_the_order_of_the_limits_of_their_strain():
    (gauge,) = (spec for spec in tree_of("single_link").config.sensors if spec.kind == "strain_gauge")
    two = replace(gauge, name="pair", channels=("x", "y"), output=-0.5, limit=2e-3)
    config = replace(tree_of("single_link").config, sensors=(two, gauge))
    gauges = gauges_of(config)
    gauges.hear([gauge.name, "pair", "pair"], [1e-4, 2e-4, 3e-4])
    assert gauges.read() == (-4e-4, -6e-4, 1e-4)
    assert limits_of(config).gauges == ("pair.x", "pair.y", f"{gauge.name}.{gauge.channels[0]}")
    unbound = replace(config, sensors=(replace(two, limit=math.inf), gauge))
    assert (gauges_of(config).unheard, gauges_of(unbound).unheard) == ((0, 1, 2), (2,))


def test_a_motor_too_weak_for_the_weight_of_its_arm_is_refused_by_name():
    """Level, the shoulder holds 0.61 N m."""
    weak = load_config(
        find_manipulator("variable_stiffness"), changes={"joints.shoulder.axes.rz.effort": "0.5 N m"}
    )
    with pytest.raises(ConfigError, match=r"shoulder\.rz: effort 0\.5: the motor cannot hold the weight"):
        guard_limits(weak, ReducedTree(weak), SETTINGS)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("max_age", math.nan),
        ("max_age", 1e9),
        ("max_age", -1.0),
        ("braking_share", 5.0),
        ("velocity_margin", math.nan),
        ("energy_margin", math.nan),
        ("position_noise", math.inf),
    ],
)
def test_a_setting_that_lets_the_guard_sleep_is_refused_by_name(name, value):
    """With a ``max_age`` that is no number a silent controller stopped nothing."""
    with pytest.raises(ParameterError, match=rf"{name}: {value} is not a finite number in \["):
        replace(SETTINGS, **{name: value})
