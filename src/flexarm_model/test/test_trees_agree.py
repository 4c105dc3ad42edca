"""The reduced tree and the segment tree at rest: two formulations of one graph, with one limit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest
from arms import BAR, Array, arm, bar, tree
from beam_theory import cantilever
from finite_difference import finite_difference
from scipy.linalg import eigh

from flexarm_model.manipulator.body_spec import Reduction
from flexarm_model.manipulator.description import WORLD, Axis, Joint, ManipulatorConfig, NodeRef
from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.served.linearize import find_equilibrium
from flexarm_model.tree.reduced_tree import ReducedTree

SEGMENTS = np.array([8, 16, 32])

# The reduction drops modes: 1e-4. The spatial arm hangs under gravity, where the reduced tree lacks a term:
# a bent link that twists turns its bending plane. The error is linear in gravity and 6e-4 at 1 g.
LEFT_OVER = [("single_link", 1e-4), ("planar", 1e-4), ("spatial", 1e-3)]
Forces = Callable[[Array, Array, Array], Array]


def equilibrium(segments: SegmentTree, pose: Array) -> Array:
    """Return the coordinates at rest by Newton's method on finite differences."""
    q, rest = np.zeros(segments.n_q), np.zeros(segments.n_q)
    q[segments.actuated] = pose
    e = np.setdiff1d(np.arange(q.size), segments.actuated)
    for _ in range(4):
        K = finite_difference(lambda x: segments.inverse_dynamics(x, rest, rest), q, 0.1)
        q[e] -= np.linalg.solve(K[np.ix_(e, e)], segments.inverse_dynamics(q, rest, rest)[e])
    return q


def locked(M: Array, K: Array, actuated: list[int], count: int) -> Array:
    e = np.setdiff1d(np.arange(M.shape[0]), actuated)
    return np.array(np.sqrt(eigh(K[np.ix_(e, e)], M[np.ix_(e, e)], eigvals_only=True)[:count]))


@cache
def reduced_rest(name: str) -> tuple[Array, Array]:
    """Return the first three locked frequencies and the tip's position at home."""
    arm_tree = tree(name)
    q, _ = find_equilibrium(arm_tree, arm(name).home)
    M, _, K, _ = (np.array(part) for part in arm_tree.linearisation(q))
    return locked(M, (K + K.T) / 2, arm_tree.actuated, 3), arm_tree.tip_pose(q)[:3, 3]


@cache
def segment_rest(name: str) -> tuple[Array, Array]:
    """Return the same of segment trees, (3, 3) each, a row per number of segments."""
    omega, tips = [], []
    for n in SEGMENTS:
        segments = SegmentTree(arm(name), int(n))
        q = equilibrium(segments, arm(name).home)
        omega.append(segments.locked_frequencies(q, 3))
        tips.append(segments.tip_pose(q)[:3, 3])
    return np.array(omega), np.array(tips)


@pytest.mark.parametrize(("name", "rel"), LEFT_OVER)
def test_segment_frequencies_converge_with_order_two_onto_the_reduced_trees(name: str, rel: float) -> None:
    omega, _ = reduced_rest(name)
    found, _ = segment_rest(name)
    order = np.log2((found[0] - found[1]) / (found[1] - found[2]))
    assert order == pytest.approx(2.0, abs=0.15)
    assert (4 * found[2] - found[1]) / 3 == pytest.approx(omega, rel=rel)


@pytest.mark.slow
def test_without_gravity_the_spatial_frequencies_agree_to_the_modes_left_out() -> None:
    config = replace(arm("spatial"), gravity=np.zeros(3))
    reduced = ReducedTree(config, use_compiler=False)
    q = np.zeros(reduced.n_q)
    q[reduced.actuated] = config.home
    M, _, K, _ = (np.array(part) for part in reduced.linearisation(q))
    found = []
    for n in SEGMENTS[1:]:
        segments = SegmentTree(config, int(n))
        found.append(segments.locked_frequencies(equilibrium(segments, config.home), 3))
    limit = (4 * found[1] - found[0]) / 3
    assert limit == pytest.approx(locked(M, (K + K.T) / 2, reduced.actuated, 3), rel=2e-5)


@pytest.mark.parametrize("name", ["single_link", "planar", "spatial"])
def test_both_trees_hang_alike(name: str) -> None:
    _, tip = reduced_rest(name)
    _, tips = segment_rest(name)
    # third order in the deflection over the length: (13 mm / 0.7 m)^2 of 13 mm, under gravity
    assert (4 * tips[2] - tips[1]) / 3 == pytest.approx(tip, abs=4e-6)


def test_gravity_bends_the_spatial_arm_as_a_beam_is_bent() -> None:
    """A check that the case above is one: the tip hangs by millimetres, not by rounding."""
    arm_tree = tree("spatial")
    straight = np.zeros(arm_tree.n_q)
    straight[arm_tree.actuated] = arm("spatial").home
    sag = arm_tree.tip_pose(straight)[2, 3] - reduced_rest("spatial")[1][2]
    assert 0.003 < sag < 0.03


def spinning_bar(kind: str) -> ManipulatorConfig:
    """Return a bar on a vertical axis."""
    body = replace(bar([kind], elements=16), reduction=Reduction("craig_bampton", 8, "clamped"))
    base = Joint(
        "base", NodeRef(WORLD, "root"), NodeRef("bar", "root"), np.eye(4), (Axis("rz", actuated=True),)
    )
    return replace(
        arm("planar"), bodies={"bar": body}, joints=(base,), sensors=(), tip=NodeRef("bar", "end"),
        gravity=np.zeros(3), home=np.zeros(1),
    )  # fmt: skip


def southwell_coefficient(forces: Forces, M: Array, spin: float) -> float:
    """Return (omega^2 - omega_0^2) / spin^2 of the first mode with the axis turning at a constant rate."""
    rest, v = np.zeros(M.shape[0]), np.zeros(M.shape[0])
    v[0] = spin
    inner = (slice(1, None), slice(1, None))
    values = []
    for rate in (rest, v):
        K = finite_difference(partial(lambda x, rate: forces(x, rate, rest), rate=rate), rest)[inner]
        values.append(eigh((K + K.T) / 2, M[inner], eigvals_only=True)[0])
    return float((values[1] - values[0]) / spin**2)


def exact_coefficient(kind: str) -> float:
    """Return Rayleigh's quotient of the centrifugal tension over the exact mode of the bar at rest."""
    second = {"bend_y": BAR.I_z, "bend_z": BAR.I_y}[kind]
    shape = cantilever(BAR.E, second, BAR.density * BAR.area, BAR.length, 1e-12, 0.25, 1).shapes[0]
    point, weight = np.polynomial.legendre.leggauss(40)
    x, w = (point + 1) * BAR.length / 2, weight * BAR.length / 2
    quotient = w @ ((BAR.length**2 - x**2) / 2 * shape(x, 1) ** 2) / (w @ shape(x) ** 2)
    return float(quotient - (1.0 if kind == "bend_y" else 0.0))


# Southwell's constants of a cantilever without a hub, in the plane of rotation and out of it [Southwell1921]
SOUTHWELL = [("bend_y", 0.193), ("bend_z", 1.193)]


@pytest.mark.parametrize(("kind", "constant"), SOUTHWELL)
def test_a_spinning_bar_stiffens_by_southwells_constant(kind: str, constant: float) -> None:
    exact = exact_coefficient(kind)
    assert exact == pytest.approx(constant, abs=5e-4)  # the constant's printed digits
    config, spin = spinning_bar(kind), 10.0  # [rad/s]: slow beside the first mode, so that its shape stays
    reduced = ReducedTree(config, use_compiler=False)
    M = np.array(reduced.functions["mass_matrix"](np.zeros(reduced.n_q)))
    found = southwell_coefficient(lambda *x: np.array(reduced.functions["inverse_dynamics"](*x)), M, spin)
    assert found == pytest.approx(exact, abs=2e-3)  # (spin / omega)^2 changes the shape a little
    error = []
    for n in (8, 16):
        segments = SegmentTree(config, n)
        M = segments.mass_matrix(np.zeros(segments.n_q))
        error.append(southwell_coefficient(segments.inverse_dynamics, M, spin) - found)
    assert error[0] / error[1] == pytest.approx(4.0, abs=0.3)  # order two
    assert (4 * error[1] - error[0]) / 3 == pytest.approx(0.0, abs=1e-3)
