"""Loops of the segment tree against closed forms: linkages, beams held at both ends, a pendulum, energy."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pinocchio as pin
import pytest
from arms import BAR, Array, arm, bar
from finite_difference import assert_jacobian, finite_difference
from rigid_arms import rigid_version
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from flexarm_model.manipulator.body_spec import RigidBody
from flexarm_model.manipulator.description import WORLD, Axis, Joint, ManipulatorConfig, NodeRef
from flexarm_model.segments.segment_loops import null_space
from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.tree.closure_error import ClosureError

CRANK, COUPLER, ROCKER, GROUND = 0.2, 0.25, 0.2, 0.3  # of arms/four_bar.yaml [m]
STRETCHED = np.arccos((CRANK**2 + GROUND**2 - (COUPLER + ROCKER) ** 2) / (2 * CRANK * GROUND))
PIVOT = np.array([GROUND, 0.0])
ROOT = NodeRef(WORLD, "root")
THIN = BAR.I_z * 1e-6  # so that the section's rotary inertia, which the theory neglects, is nothing


def direction(angle: float) -> Array:
    return np.array([np.cos(angle), np.sin(angle)])


def meet(a: Array, b: Array, from_a: float, from_b: float) -> Array:
    """Return where the circles about a and b meet, on the left of the way from a to b."""
    way = b - a
    distance = np.linalg.norm(way)
    along = (distance**2 + from_a**2 - from_b**2) / (2 * distance)
    aside = np.sqrt(from_a**2 - along**2)
    return np.asarray(a + (along * way + aside * np.array([-way[1], way[0]])) / distance)


def linkage(theta: float) -> tuple[Array, Array, float, float]:
    """Return elbow, hinge, and the angles of coupler and rocker of the four-bar."""
    elbow = CRANK * direction(theta)
    hinge = meet(elbow, PIVOT, COUPLER, ROCKER)
    coupler, rocker = hinge - elbow, hinge - PIVOT
    return elbow, hinge, float(np.arctan2(*coupler[::-1])), float(np.arctan2(*rocker[::-1]))


def rigid(name: str) -> SegmentTree:
    return SegmentTree(rigid_version(arm(name)), 1)


def seen_by_motors(segments: SegmentTree, q: Array) -> Array:
    """Return the motions within the loops per motor rate, (n_q, n_theta), of an arm without springs."""
    N = segments.null_space(q)
    assert N.shape[1] == len(segments.actuated)
    return np.asarray(N @ np.linalg.inv(N[segments.actuated]))


@pytest.mark.parametrize("degrees", [-60, 20, 60, 100, 127])
def test_the_hinge_of_the_four_bar_stands_where_the_circles_meet(degrees: float) -> None:
    segments, theta = SegmentTree(arm("four_bar"), 4), np.radians(degrees)
    q = segments.close(np.array([theta]))
    _, hinge, coupler, rocker = linkage(theta)
    for body, angle in (("coupler", coupler), ("rocker", rocker)):
        pose = segments.node_pose(q, NodeRef(body, "end"))
        assert pose[:3, 3] == pytest.approx([*hinge, 0.0], abs=1e-9)  # rows close to 1e-11, seen at 127 deg
        assert pose[:2, 0] == pytest.approx(direction(angle), abs=1e-7)


@pytest.mark.parametrize("pose", [(130, 50), (150, 70), (100, 20)])
def test_the_hinge_of_the_five_bar_stands_where_the_circles_meet(pose: tuple[float, float]) -> None:
    segments, theta = SegmentTree(arm("five_bar"), 4), np.radians(pose)
    left, right = 0.15 * direction(theta[0]), np.array([0.2, 0.0]) + 0.15 * direction(theta[1])
    q = segments.close(theta)
    assert segments.tip_pose(q)[:2, 3] == pytest.approx(meet(left, right, 0.22, 0.22), abs=1e-9)
    assert q[segments.actuated] == pytest.approx(theta, abs=1e-15)


@pytest.mark.parametrize("degrees", [-60, 20, 60, 120])
def test_the_rocker_turns_by_the_law_of_sines(degrees: float) -> None:
    segments, theta = rigid("four_bar"), np.radians(degrees)
    q = segments.close(np.array([theta]))
    _, _, coupler, rocker = linkage(theta)
    ratio = CRANK / ROCKER * np.sin(theta - coupler) / np.sin(rocker - coupler)
    index = segments.model.joints[segments.model.getJointId("pivot.rz")].idx_v
    assert seen_by_motors(segments, q)[index, 0] == pytest.approx(ratio, rel=1e-8)


def test_the_motor_feels_the_masses_by_their_squared_velocity_ratios() -> None:
    config, segments, theta = rigid_version(arm("four_bar")), rigid("four_bar"), np.radians(75)
    inertia = arm("four_bar").axes["base.rz"].rotor_inertia

    def centre(start: Array, angle: float, body: str) -> Array:
        com, side = config.bodies[body].com, np.array([-np.sin(angle), np.cos(angle)])
        return np.asarray(start + com[0] * direction(angle) + com[1] * side)

    def places(x: Array) -> Array:
        elbow, _, coupler, rocker = linkage(x[0])
        found = []
        for start, angle, body in (
            (np.zeros(2), x[0], "crank"), (elbow, coupler, "coupler"), (PIVOT, rocker, "rocker"),
        ):  # fmt: skip
            m, J = config.bodies[body].mass, config.bodies[body].inertia[2, 2]
            found += [*(np.sqrt(m) * centre(start, angle, body)), np.sqrt(J) * angle]
        return np.array(found)

    rates = finite_difference(places, np.array([theta]), 0.1)
    per_motor = seen_by_motors(segments, q := segments.close(np.array([theta])))
    felt = per_motor.T @ segments.mass_matrix(q) @ per_motor
    assert felt[0, 0] == pytest.approx(inertia + np.sum(rates**2), rel=1e-9)


def test_a_stretched_linkage_is_refused_by_name() -> None:
    with pytest.raises(ClosureError, match=r"four_bar at pose \[2\.219\d*\] is singular.*rank 2 of 3"):
        SegmentTree(arm("four_bar"), 4).close(np.array([STRETCHED]))


def test_a_linkage_beyond_its_reach_is_refused_by_name() -> None:
    with pytest.raises(
        ClosureError, match=r"four_bar at pose \[2\.25\]: a loop cannot be closed; 0\.00\d+ m"
    ):
        SegmentTree(arm("four_bar"), 4).close(np.array([2.25]))


def test_without_loops_closing_sets_the_motors() -> None:
    segments = SegmentTree(arm("planar"), 4)
    q = segments.close(np.array([0.2, 0.4]))
    assert np.flatnonzero(q).tolist() == segments.actuated and q[segments.actuated].tolist() == [0.2, 0.4]


@pytest.mark.parametrize("name", ["four_bar", "five_bar"])
def test_rows_and_their_drift_are_derivatives(name: str) -> None:
    segments = SegmentTree(arm(name), 3)
    rng, q = np.random.default_rng(1), segments.close(arm(name).home)
    loops = segments.loops
    assert_jacobian(loops.residual, q, loops.jacobian(q), 0.3)
    bent, v = q + rng.normal(0, 0.1, q.size), rng.normal(0, 1, q.size)
    along = finite_difference(lambda t: loops.jacobian(bent + t[0] * v) @ v, np.zeros(1), 0.3)[:, 0]
    assert loops.drift(bent, v) == pytest.approx(along, abs=1e-8 * abs(along).max())


@pytest.mark.parametrize("name", ["four_bar", "five_bar"])
def test_the_mass_matrix_of_branches_is_the_force_of_unit_accelerations(name: str) -> None:
    segments = SegmentTree(replace(arm(name), gravity=np.zeros(3)), 3)
    q, rest = segments.close(arm(name).home) + 0.1, np.zeros(segments.n_q)
    columns = [segments.inverse_dynamics(0 * q, rest, e) for e in np.eye(segments.n_q)]
    assert segments.mass_matrix(0 * q) == pytest.approx(np.array(columns).T, abs=1e-14)


def held_beam(own: tuple[Axis, ...], far: tuple[Axis, ...]) -> ManipulatorConfig:
    """Return a bar whose root and end stand on the world by these axes."""
    placement, root, end = np.eye(4), NodeRef("bar", "root"), NodeRef("bar", "end")
    placement[0, 3] = BAR.length
    return replace(
        arm("planar"), bodies={"bar": bar(I_z=THIN)}, sensors=(), tip=end, gravity=np.zeros(3),
        joints=(Joint("near", ROOT, root, np.eye(4), own),), home=np.zeros(0),
        closures=(Joint("far", ROOT, end, placement, far),),
    )  # fmt: skip


def steep(x: float) -> float:
    """Return the frequency equation of a clamped and pinned beam."""
    return float(np.tan(x) - np.tanh(x))


HINGE, SLIDE = Axis("rz"), Axis("tx")
HELD = [
    ((), (), brentq(lambda x: np.cos(x) * np.cosh(x) - 1, 4, 5), 2),
    ((), (HINGE,), brentq(steep, 3.5, 4.5), 2),
    ((), (SLIDE, HINGE), brentq(steep, 3.5, 4.5), 2),  # sliding is of second order
    ((HINGE,), (HINGE,), np.pi, 4),  # lumped mass and lumped bending cancel where no bending meets a clamp
]


@pytest.mark.parametrize(("own", "far", "wave_number", "order"), HELD)
def test_a_beam_held_at_both_ends_rings_as_theory_says(
    own: tuple[Axis, ...], far: tuple[Axis, ...], wave_number: float, order: int
) -> None:
    exact = (wave_number / BAR.length) ** 2 * np.sqrt(BAR.E * THIN / (BAR.density * BAR.area))
    errors = []
    for n in (8, 16, 32):
        segments = SegmentTree(held_beam(own, far), n)
        errors.append(segments.locked_frequencies(segments.close(np.zeros(0)), 1)[0] / exact - 1)
    assert abs(errors[2]) < 2e-3
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.2)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(order, abs=0.1)


def test_the_force_of_a_loop_stiffens_a_pendulum() -> None:
    """A body that floats in its plane, held at one point by a loop: only the loop's force turns it back."""
    m, lever, J, k = 2.0, 0.3, 0.05, 1.5
    body = RigidBody("bob", m, np.array([lever, 0.0, 0.0]), np.diag([J, J, J]), {"root": np.zeros(3)})
    bob = NodeRef("bob", "root")
    floating = (Axis("tx"), Axis("ty"), Axis("rz", stiffness=k))
    config = replace(
        arm("planar"), bodies={"bob": body}, sensors=(), tip=bob, home=np.zeros(0),
        gravity=np.array([9.81, 0.0, 0.0]), joints=(Joint("float", ROOT, bob, np.eye(4), floating),),
        closures=(Joint("nail", ROOT, bob, np.eye(4), (HINGE,)),),
    )  # fmt: skip
    segments = SegmentTree(config, 1)
    omega = segments.locked_frequencies(segments.settle(np.zeros(0)), 1)
    assert omega == pytest.approx([np.sqrt((k + m * 9.81 * lever) / (J + m * lever**2))], rel=1e-8)


def energy(segments: SegmentTree, q: Array, v: Array) -> float:
    """Return kinetic and gravitational energy by Pinocchio, and that of the springs [J]."""
    kinetic = pin.computeKineticEnergy(segments.model, segments.data, q, v)  # rotors included
    return float(
        kinetic + pin.computePotentialEnergy(segments.model, segments.data, q) + q @ segments.K @ q / 2
    )


def test_the_motor_holds_the_slope_of_the_energy() -> None:
    segments, pose = SegmentTree(arm("four_bar"), 6), np.array([0.7])
    q = segments.settle(pose)
    e = np.setdiff1d(np.arange(segments.n_q), segments.actuated)
    h, G = segments.inverse_dynamics(q, 0 * q, 0 * q), segments.loops.jacobian(q)
    torque = (h - G.T @ np.linalg.lstsq(G[:, e].T, h[e], rcond=None)[0])[segments.actuated]
    slope = finite_difference(lambda x: np.array(energy(segments, segments.settle(x), 0 * q)), pose, 0.3)
    assert torque == pytest.approx(slope, rel=1e-7)
    assert abs(q[e] - segments.close(pose)[e]).max() > 1e-4  # it does bend


def swing(segments: SegmentTree, rates: Array, duration: float) -> tuple[Array, Array]:
    """Return coordinates and rates before and after a free swing, (2, n_q) each."""
    n, q = segments.n_q, segments.settle(segments.config.home)
    N = segments.null_space(q)
    v = N @ np.linalg.lstsq(N[segments.actuated], rates, rcond=None)[0]

    def rate(_: float, x: Array) -> Array:
        return np.concatenate([x[n:], segments.forward_dynamics(x[:n], x[n:], np.zeros(n))])

    run = partial(solve_ivp, method="DOP853", rtol=1e-9, atol=1e-11)
    end = run(rate, (0, duration), np.concatenate([q, v])).y[:, -1]
    return np.array([q, end[:n]]), np.array([v, end[n:]])


@pytest.mark.slow
@pytest.mark.parametrize(("name", "rates"), [("four_bar", [8.0]), ("five_bar", [6.0, -4.0])])
def test_an_undamped_linkage_keeps_its_energy_and_its_loop(name: str, rates: list[float]) -> None:
    segments = SegmentTree(arm(name), 3)
    segments.D[:] = 0.0
    q, v = swing(segments, np.array(rates), 0.05)
    assert abs(q[1] - q[0])[segments.actuated].max() > 0.1
    assert energy(segments, q[1], v[1]) == pytest.approx(energy(segments, q[0], v[0]), rel=1e-6)
    assert abs(segments.loops.residual(q[1])).max() < 1e-8
    assert abs(segments.loops.jacobian(q[1]) @ v[1]).max() < 1e-6


def test_the_ratio_of_all_beams_is_the_ratio_of_every_mode() -> None:
    segments = SegmentTree(arm("five_bar"), 4)
    q = segments.close(arm("five_bar").home)
    e = np.setdiff1d(np.arange(segments.n_q), segments.actuated)
    N = null_space(segments.loops.jacobian(q)[:, e])
    M, D, K = (N.T @ part[np.ix_(e, e)] @ N for part in (segments.mass_matrix(q), segments.D, segments.K))
    n = M.shape[0]
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])
    poles = np.linalg.eigvals(A)
    assert -poles.real / abs(poles) == pytest.approx(np.full(2 * n, 0.01), rel=1e-6)


def test_a_damping_time_damps_in_proportion_to_the_stiffness() -> None:
    bodies = arm("planar").bodies
    config = replace(arm("planar"), bodies={**bodies, "fore": replace(bodies["fore"], damping_time=2e-4)})
    segments = SegmentTree(config, 4)
    springs = np.flatnonzero(np.diag(segments.K))
    assert np.diag(segments.D)[springs[4:]] == pytest.approx(2e-4 * np.diag(segments.K)[springs[4:]])
    assert not np.diag(segments.D)[springs[:4]].any()
