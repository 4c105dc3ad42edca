"""Reduced tree and segment tree with loops: one graph, two formulations, one limit."""

from __future__ import annotations

from functools import cache, partial

import numpy as np
import pytest
from arms import Array, arm, tree, with_modes
from closed_motion import forward_dynamics, move
from rigid_arms import rigid_version
from scipy.linalg import eigh

from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.served.linearize import find_equilibrium, linearize
from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.reduced_tree import ReducedTree

SEGMENTS = (8, 16, 32)
STRETCHED = 2.2195352  # [rad]: coupler and rocker of the four-bar in line, see test_segment_loops.py


@cache
def fine(name: str) -> ReducedTree:
    """Return the reduced tree with enough modes that what it leaves out is little."""
    return ReducedTree(with_modes(arm(name), 8, 16), use_compiler=False)


def places(segments: SegmentTree, reduced: ReducedTree) -> list[int]:
    """Return where the reduced tree's axes stand in the segment tree."""
    return [segments.axes[name] for name in reduced.axis_names]


@pytest.mark.parametrize("name", ["four_bar", "five_bar"])
def test_rigid_linkages_have_the_same_equations_in_both_trees(name: str) -> None:
    config = rigid_version(arm(name))
    reduced, segments = ReducedTree(config, use_compiler=False), SegmentTree(config, 1)
    at, rng = places(segments, reduced), np.random.default_rng(3)
    for q, v, a in rng.uniform(-1.5, 1.5, (50, 3, reduced.n_q)):
        theirs = [np.zeros(segments.n_q) for _ in range(3)]
        for x, y in zip(theirs, (q, v, a), strict=True):
            x[at] = y
        force = segments.inverse_dynamics(*theirs)[at]
        assert np.array(reduced.functions["inverse_dynamics"](q, v, a)) == pytest.approx(force, abs=1e-13)
        M = segments.mass_matrix(theirs[0])[np.ix_(at, at)]
        assert np.array(reduced.functions["mass_matrix"](q)) == pytest.approx(M, abs=1e-15)


@pytest.mark.parametrize("name", ["four_bar", "five_bar"])
def test_rigid_linkages_close_alike_and_leave_the_same_motions(name: str) -> None:
    config = rigid_version(arm(name))
    reduced, segments = ReducedTree(config, use_compiler=False), SegmentTree(config, 1)
    at = places(segments, reduced)
    for share in (0.0, 0.3, -0.2):
        pose = config.home + share
        q, _ = find_equilibrium(reduced, pose)
        theirs = segments.close(pose)
        assert q == pytest.approx(theirs[at], abs=1e-9)
        N = segments.null_space(theirs)[at]
        assert reduced.constraints(q)[1] @ N == pytest.approx(np.zeros((reduced.n_c, N.shape[1])), abs=1e-9)
        ours = N @ np.linalg.inv(N[reduced.actuated])
        assert reduced.motions_within(q) == pytest.approx(ours, abs=1e-8)


# between hinges a beam of segments errs by the fourth order (see test_segment_loops.py), so the four-bar's
# modes and the five-bar's later ones converge faster; the five-bar's first bends the crank at its clamp
@pytest.mark.parametrize(("name", "slowest"), [("four_bar", 2.6), ("five_bar", 2.0)])
def test_segment_frequencies_of_linkages_converge_onto_the_reduced_trees(name: str, slowest: float) -> None:
    exact = linearize(fine(name), modes=4).omega
    found = []
    for n in SEGMENTS:
        segments = SegmentTree(arm(name), n)
        found.append(segments.locked_frequencies(segments.settle(arm(name).home), 4))
    change = abs(np.diff(found, axis=0))
    seen = change[1] > 1e-6 * exact
    assert np.log2(change[0] / change[1])[seen].min() == pytest.approx(slowest, abs=0.1)
    assert found[2] == pytest.approx(exact, rel=2e-4)


def test_with_the_motors_free_both_trees_have_two_rigid_motions_and_the_same_modes() -> None:
    served = linearize(fine("five_bar"), modes=12)
    exact = np.sqrt(np.maximum(eigh(served.K, served.M, eigvals_only=True), 0.0))
    segments = SegmentTree(arm("five_bar"), 16)
    found = segments.frequencies(segments.settle(arm("five_bar").home), 5)
    assert found[:2] == pytest.approx([0.0, 0.0], abs=1e-3 * found[2])  # but for rounding
    assert found[2:] == pytest.approx(exact[2:5], rel=1e-3)  # second order in 1/16


def test_both_trees_refuse_the_stretched_linkage() -> None:
    with pytest.raises(ClosureError, match="four_bar"):
        linearize(tree("four_bar"), np.array([STRETCHED]))
    with pytest.raises(ClosureError, match="four_bar"):
        SegmentTree(arm("four_bar"), 4).close(np.array([STRETCHED]))


TIMES = np.linspace(0, 0.06, 21)  # [s]: the torque swings once in 0.05 s


def shake(t: float, torque: Array) -> Array:
    return torque * np.sin(2 * np.pi * t / 0.05)


@cache
def reduced_shaken(name: str, torque: tuple[float, ...]) -> tuple[Array, Array]:
    """Return tool path (k, 3) and gauges (k, 2) of the reduced tree."""
    reduced = tree(name)
    start, _ = find_equilibrium(reduced, arm(name).home)
    drive = partial(shake, torque=np.array(torque))
    path = move(partial(forward_dynamics, reduced), reduced.actuated, start, TIMES, drive)
    outputs, rest = reduced.functions["outputs"], 0 * start
    tip = np.array([reduced.tip_pose(q)[:3, 3] for q in path])
    return tip, np.array([np.array(outputs(q, rest, rest, q))[:2] for q in path])


@cache
def segments_shaken(name: str, torque: tuple[float, ...]) -> tuple[Array, Array]:
    """Return the same of the segment tree, extrapolated from 4 and 8 segments."""
    found = []
    for n in (4, 8):
        segments, config = SegmentTree(arm(name), n), arm(name)
        drive = partial(shake, torque=np.array(torque))
        path = move(segments.forward_dynamics, segments.actuated, segments.settle(config.home), TIMES, drive)
        tip = np.array([segments.tip_pose(q)[:3, 3] for q in path])
        found.append((tip, np.array([[segments.strain(q, gauge) for gauge in config.sensors] for q in path])))
    (tip_4, strain_4), (tip_8, strain_8) = found
    return (4 * tip_8 - tip_4) / 3, (4 * strain_8 - strain_4) / 3


SHAKEN = [
    pytest.param("four_bar", (8.0,), marks=pytest.mark.slow),
    pytest.param("five_bar", (3.0, -2.0)),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "torque"), SHAKEN)
def test_linkages_move_and_strain_alike(name: str, torque: tuple[float, ...]) -> None:
    tip, strain = reduced_shaken(name, torque)
    tip_limit, strain_limit = segments_shaken(name, torque)
    assert np.ptp(tip, axis=0).max() > 0.03 and abs(strain).max() > 4e-5  # it is a large motion
    assert tip_limit == pytest.approx(tip, abs=2e-5)
    # what is left falls with the square of the torque, and hardly with more segments
    assert strain_limit == pytest.approx(strain, abs=0.015 * abs(strain).max())


@pytest.mark.slow
def test_what_is_left_of_the_path_is_third_order_in_the_torque() -> None:
    left = []
    for torque in ((3.0, -2.0), (1.5, -1.0)):
        left.append(abs(segments_shaken("five_bar", torque)[0] - reduced_shaken("five_bar", torque)[0]).max())
    assert np.log2(left[0] / left[1]) == pytest.approx(3.0, abs=0.3)
