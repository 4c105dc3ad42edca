"""The served form against the exact strip, the segment tree and finite differences."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from arms import Array, arm, bar, scales, tree
from beam_theory import BeamModes, cantilever
from finite_difference import assert_jacobian, finite_difference

from flexarm_model.manipulator.body_spec import Beam, Reduction, RigidBody
from flexarm_model.manipulator.description import WORLD, Axis, Joint, ManipulatorConfig, NodeRef
from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.served.linearize import PoseError, linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

ARMS = ["single_link", "planar", "spatial"]
CLAMP = 0.010  # the strip's root from the axis [m]


@cache
def served(name: str) -> ReducedModel:
    return linearize(tree(name))


@cache
def exact_strip() -> BeamModes:
    strip = arm("single_link").bodies["strip"]
    assert isinstance(strip, Beam)
    piece, mass = strip.pieces[0], strip.point_masses[0]
    rho_A, rho_I = piece.density * piece.area, piece.density * piece.I_z
    return cantilever(piece.E, piece.I_z, rho_A, piece.length, mass.mass, mass.at, 3, rho_I, CLAMP)


def test_the_single_link_has_the_exact_frequencies() -> None:
    assert served("single_link").omega == pytest.approx(exact_strip().omega, rel=1e-4)
    assert served("single_link").omega[0] / (2 * np.pi) == pytest.approx(
        5.230, abs=5e-4
    )  # seed 002, section 3


def test_the_single_link_couples_to_its_hub_as_the_exact_modes_do() -> None:
    model = served("single_link")
    assert abs(model.M[0, 1:]) == pytest.approx(abs(exact_strip().participation), rel=1e-4)
    # hub and rigid strip about the axis; the strip's share is printed as 0.0648 kg m^2 in seed 002
    assert model.M[0, 0] - 0.30 == pytest.approx(0.0648, abs=5e-5)


def test_the_single_links_sensors_see_the_exact_shapes() -> None:
    model = served("single_link")
    out, shapes = model.outputs, exact_strip().shapes
    sign = np.sign(model.M[0, 1:] / exact_strip().participation)
    [felt], [strain] = out.rows("tip_accelerometer"), out.rows("root_strain")
    assert out.C_acc[felt] == pytest.approx([0.630, *sign * [float(s(0.620)) for s in shapes]], rel=1e-4)
    assert out.C_pos[felt] == pytest.approx(0.0, abs=1e-12)
    curvature = sign * [float(s(0.005, 2)) for s in shapes]
    assert out.C_pos[strain] == pytest.approx(
        [0.0, *(-0.0016 * curvature)], rel=1e-3
    )  # cubic elements: order 2
    tip = out.rows("tip")[1]
    assert out.C_pos[tip] == pytest.approx([0.640, *sign * [float(s(0.630)) for s in shapes]], rel=5e-4)


@pytest.mark.parametrize("name", ARMS)
def test_the_served_form_has_its_shape(name: str) -> None:
    model = served(name)
    t, e = slice(0, model.n_theta), slice(model.n_theta, None)
    assert model.M[e, e] == pytest.approx(np.eye(model.n_eta), abs=1e-9)
    assert model.K[e, e] == pytest.approx(np.diag(model.omega**2), rel=1e-9, abs=1e-9 * model.K.max())
    assert abs(model.K[t, e]).max() < 1e-9 * model.K.max()
    assert pytest.approx(np.eye(model.n)[:, t], abs=0) == model.B
    assert (np.diff(model.omega) > 0).all() and np.linalg.eigvalsh(model.M).min() > 0
    assert np.diag(model.D)[e] == pytest.approx(2 * model.zeta * model.omega, rel=1e-12, abs=1e-15)


@pytest.mark.parametrize("name", ARMS)
def test_locked_frequencies_are_the_segment_trees_limit(name: str) -> None:
    pose = arm(name).home
    found = []
    for n in (16, 32):
        segments = SegmentTree(arm(name), n)
        q = np.zeros(segments.n_q)
        q[segments.actuated] = pose
        found.append(segments.locked_frequencies(q, 3))
    # the segments are taken straight: under gravity the sag of the spatial arm costs 1e-3
    rel = {"spatial": 5e-3}.get(name, 1e-4)
    assert (4 * found[1] - found[0]) / 3 == pytest.approx(served(name).omega[:3], rel=rel)


@pytest.mark.parametrize("name", ARMS)
def test_it_is_the_tree_to_first_order(name: str) -> None:
    """T' f(q0 + T xi, T xi', T xi'') has the derivatives M, D, K and the value f0."""
    model, forces = served(name), tree(name).functions["inverse_dynamics"]
    T, zero = model.Phi, np.zeros(tree(name).n_q)
    small = np.linalg.norm(scales(tree(name))[:, None] * np.linalg.pinv(T).T, axis=0)
    assert model.f0 == pytest.approx(T.T @ np.array(forces(model.q0, zero, zero)), rel=1e-12, abs=1e-12)
    assert abs(model.f0[model.n_theta :]).max() < 1e-8
    rest = np.zeros(model.n)
    assert_jacobian(lambda x: T.T @ forces(model.q0, zero, T @ x), rest, model.M, small)
    assert_jacobian(lambda x: T.T @ forces(model.q0 + T @ x, zero, zero), rest, model.K, small)
    D = finite_difference(lambda x: T.T @ forces(model.q0, T @ x, zero), rest, small)
    assert pytest.approx(D, abs=1e-8 * np.linalg.norm(model.K)) == model.D


@pytest.mark.parametrize("name", ARMS)
def test_its_rows_are_the_derivatives_of_the_outputs(name: str) -> None:
    model, outputs = served(name), tree(name).functions["outputs"]
    T, q0, zero, out = model.Phi, model.q0, np.zeros(tree(name).n_q), model.outputs
    small = np.linalg.norm(scales(tree(name))[:, None] * np.linalg.pinv(T).T, axis=0)
    rest = np.zeros(model.n)
    assert out.y0 == pytest.approx(np.array(outputs(q0, zero, zero, q0)), abs=1e-12)
    assert_jacobian(lambda x: outputs(q0 + T @ x, zero, zero, q0), rest, out.C_pos, small)
    assert_jacobian(lambda x: outputs(q0, zero, T @ x, q0), rest, out.C_acc, small)
    C_vel = finite_difference(lambda x: outputs(q0, T @ x, zero, q0), rest, small)
    assert out.C_vel == pytest.approx(C_vel, abs=1e-8 * np.linalg.norm(out.C_pos))
    assert len(out.names) == len(out.units) == out.y0.size


def test_gravity_is_held_by_the_torque_of_the_segment_tree() -> None:
    segments = SegmentTree(arm("spatial"), 16)
    q = np.zeros(segments.n_q)
    q[segments.actuated] = arm("spatial").home
    straight = segments.inverse_dynamics(q, 0 * q, 0 * q)[segments.actuated]
    # the sag of the arm, 13 mm, shortens the levers a little
    assert served("spatial").f0[:3] == pytest.approx(straight, rel=0.02, abs=1e-6)
    assert abs(served("spatial").q0[3:]).max() > 1e-4


POSES: list[tuple[list[float] | float, str]] = [
    ([], r"pose has 0 values; expected 1: base.rz"),
    ([0.0, 0.0], r"pose has 2 values; expected 1: base.rz"),
    (0.0, r"pose has shape \(\); expected \(1,\): base.rz"),
    ([float("nan")], r"base.rz = nan rad is not finite or outside \[-2.96706, 2.96706\] rad"),
    ([3.0], r"base.rz = 3 rad is not finite or outside \[-2.96706, 2.96706\] rad"),
    ([-float("inf")], r"base.rz = -inf rad is not finite"),
]


@pytest.mark.parametrize(("pose", "text"), POSES)
def test_a_pose_that_cannot_be_is_refused_with_what_can(pose: list[float] | float, text: str) -> None:
    with pytest.raises(PoseError, match=text):
        linearize(tree("single_link"), np.array(pose))


@pytest.mark.parametrize("count", [-1, 99])
def test_a_number_of_modes_that_cannot_be_is_refused(count: int) -> None:
    with pytest.raises(PoseError, match=f"{count} modes asked for, [0-9]+ exist"):
        linearize(tree("single_link"), modes=count)


def test_an_axis_without_limits_still_needs_a_finite_pose() -> None:
    with pytest.raises(PoseError, match="yaw.rz = inf rad is not finite"):
        linearize(tree("spatial"), np.array([np.inf, 0.0, 0.0]))


def upright(height: float) -> ManipulatorConfig:
    """Return a bar that stands on a turntable under gravity."""
    beam = replace(bar(length=height), reduction=Reduction("craig_bampton", 4, "clamped"))
    beam = replace(beam, nodes={"root": 0.0, "end": height})
    placement = np.eye(4)
    placement[:3, :3] = [[0, 0, 1], [0, 1, 0], [-1, 0, 0]]
    placement[:3, :3] = placement[:3, :3].T  # the bar's x axis points upwards
    base = Joint(
        "base", NodeRef(WORLD, "root"), NodeRef("bar", "root"), placement, (Axis("rx", actuated=True),)
    )
    return replace(
        arm("planar"), bodies={"bar": beam}, joints=(base,), sensors=(), tip=NodeRef("bar", "end"), modes=2,
        gravity=np.array([0, 0, -9.81]), home=np.zeros(1),
    )  # fmt: skip


def test_a_column_is_served_below_greenhills_height_and_refused_above() -> None:
    """A column buckles under its own weight at L^3 = 7.837 E I / (rho A g) [Greenhill1881]."""
    piece = bar().pieces[0]
    critical = (7.8373 * piece.E * piece.I_z / (piece.density * piece.area * 9.81)) ** (1 / 3)
    assert linearize(ReducedTree(upright(0.99 * critical), use_compiler=False)).omega[0] > 0
    with pytest.raises(PoseError, match="no stable equilibrium"):
        linearize(ReducedTree(upright(1.01 * critical), use_compiler=False))


@pytest.mark.parametrize("gravity", [0.0, 9.81])
def test_an_axis_that_nothing_holds_is_refused(gravity: float) -> None:
    body = RigidBody("rod", 1.0, np.array([0.1, 0, 0]), np.eye(3) * 1e-3, {"root": np.zeros(3)})
    axes = (Axis("rx", actuated=True), Axis("rz"))
    base = Joint("base", NodeRef(WORLD, "root"), NodeRef("rod", "root"), np.eye(4), axes)
    config = replace(
        arm("planar"), bodies={"rod": body}, joints=(base,), sensors=(), tip=NodeRef("rod", "root"), modes=1,
        gravity=np.array([0, 0, -gravity]), home=np.zeros(1),
    )  # fmt: skip
    with pytest.raises(PoseError, match="no stable equilibrium"):
        linearize(ReducedTree(config, use_compiler=False))


def test_a_number_of_modes_that_is_not_whole_is_refused() -> None:
    with pytest.raises(PoseError, match="2.0 modes asked for; expected a whole number"):
        linearize(tree("single_link"), modes=2.0)  # type: ignore[arg-type]
    assert linearize(tree("single_link"), modes=np.int64(2)).n_eta == 2  # type: ignore[arg-type]


def test_fewer_modes_are_the_slowest_ones() -> None:
    one: Array = linearize(tree("single_link"), modes=1).omega
    assert one == pytest.approx(served("single_link").omega[:1], rel=1e-12)


def test_more_modes_than_exist_are_refused_and_counted() -> None:
    assert linearize(tree("single_link"), modes=3).n_eta == 3
    with pytest.raises(PoseError, match=r"4 modes asked for, 3 exist; serve fewer \(served.modes\)"):
        linearize(tree("single_link"), modes=4)
    with pytest.raises(PoseError, match="5 modes asked for, 1 exist"):
        linearize(ReducedTree(replace(arm("spatial_rigid"), modes=5), use_compiler=False))


def test_what_a_mode_without_stiffness_moves_is_named() -> None:
    config = arm("planar")
    *others, last = config.joints
    loose = replace(last, axes=tuple(replace(axis, actuated=False, stiffness=0.0) for axis in last.axes))
    still = replace(config, joints=(*others, loose), home=config.home[:-1], gravity=np.zeros(3))
    with pytest.raises(
        PoseError, match=rf"no stiffness; it moves {last.name}\.rz; an axis is held by a motor"
    ):
        linearize(ReducedTree(still, use_compiler=False))
