"""Loops closed in machine code: the same as with NumPy, and as honest where they do not close."""

from __future__ import annotations

import numpy as np
import pytest
from finite_difference import finite_difference
from machines import machine

from flexarm_model.numeric.compiled import find_compiler
from flexarm_model.tree.closing import Closing, MachineClosing, PlainClosing
from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.reduced_tree import ReducedTree

LOOPED = ("planar_3rrr", "spatial_3tpt")
COMPILER = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")


def ways(name: str) -> tuple[ReducedTree, list[Closing]]:
    """Return a tree, and both ways of closing it."""
    tree = ReducedTree(machine(name))
    assert isinstance(tree.closing, MachineClosing)
    return tree, [tree.closing, PlainClosing(tree.functions["constraints"], tree.loops, name)]


@COMPILER
@pytest.mark.parametrize("name", LOOPED)
def test_both_ways_close_alike_and_leave_no_rate_across_the_loops(name: str) -> None:
    rng = np.random.default_rng(1)
    tree, both = ways(name)
    for _ in range(5):
        q = tree.loops.home + 0.001 * rng.standard_normal(tree.n_q)
        rate = rng.standard_normal(tree.n_q)
        rates = [rate.copy(), rate.copy()]
        a, b = (way.close(q, rate) for way, rate in zip(both, rates, strict=True))
        np.testing.assert_allclose(a, b, atol=1e-10)  # both stop below 1e-11
        np.testing.assert_allclose(rates[0], rates[1], atol=1e-8)
        c, G = tree.constraints(a)
        assert abs(c).max() <= 1e-11
        assert abs(G @ rates[0]).max() < 1e-12 * abs(rate).max() * tree.n_q
        np.testing.assert_array_equal(np.delete(a, tree.loops.dependent), np.delete(q, tree.loops.dependent))


@COMPILER
@pytest.mark.parametrize("name", LOOPED)
def test_rows_that_follow_the_loops_are_the_slopes_along_them(name: str) -> None:
    tree, both = ways(name)
    q = tree.closed(tree.loops.home + 0.003)
    free = np.setdiff1d(np.arange(tree.n_q), tree.loops.dependent)
    J = np.array(tree.functions["tip_jacobian"](q))[:3]
    a, b = (way.follow(J, q) for way in both)
    np.testing.assert_allclose(a, b, atol=1e-12)

    def tip(x: np.ndarray) -> np.ndarray:
        moved = q.copy()
        moved[free] = x
        return tree.tip_pose(moved)[:3, 3]

    np.testing.assert_allclose(a[:, free], finite_difference(tip, q[free], 0.2), atol=1e-7)
    assert not a[:, tree.loops.dependent].any()


@COMPILER
@pytest.mark.parametrize("bad", [2.0, np.nan])
def test_loops_that_do_not_close_are_refused_by_name(bad: float) -> None:
    tree, both = ways("planar_3rrr")
    q = tree.loops.home.copy()
    q[tree.actuated[0]] += bad  # a leg turned away from the platform
    q[-4:] += 50.0 * bad
    for way in both:
        with pytest.raises((ClosureError, np.linalg.LinAlgError), match="planar_3rrr|Singular"):
            way.close(q)


@COMPILER
@pytest.mark.parametrize("name", LOOPED)
def test_what_was_closed_stays_when_another_pose_is_closed(name: str) -> None:
    """Machine code works on one buffer, the tree remembers the last pose: nobody else may hold either."""
    tree, both = ways(name)
    q = tree.loops.home + 0.001
    for close in (*(way.close for way in both), tree.closed):
        closed = close(q)
        kept = closed.copy()
        close(tree.loops.home)
        np.testing.assert_array_equal(closed, kept)
    asked = q.copy()
    tree.closed(asked)
    asked += 0.001
    np.testing.assert_array_equal(tree.closed(asked)[tree.actuated], asked[tree.actuated])
    tree.closed(asked)[:] = 0.0
    np.testing.assert_array_equal(tree.closed(asked)[tree.actuated], asked[tree.actuated])


@COMPILER
@pytest.mark.parametrize("name", LOOPED)
def test_rows_follow_the_loops_at_the_pose_that_is_given_not_at_the_last_one(name: str) -> None:
    tree, both = ways(name)
    poses = [tree.closed(tree.loops.home + shift) for shift in (0.003, 0.0)]
    J = np.array(tree.functions["tip_jacobian"](poses[0]))
    for way in both:
        way.close(poses[1])
        rows, G = way.follow(J, poses[0]), tree.constraints(poses[0])[1]
        motions = np.eye(tree.n_q)
        d = tree.loops.dependent
        motions[d] = np.linalg.solve(G[:, d], -np.delete(G, d, axis=1) @ np.delete(motions, d, axis=0))
        motions[:, d] = 0.0
        np.testing.assert_allclose(rows, J @ motions, atol=1e-9)


@COMPILER
@pytest.mark.parametrize("name", LOOPED)
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_no_coordinate_that_is_no_number_is_closed(name: str, bad: float) -> None:
    """Only in the last row it was seen in machine code, and a tip at a plausible place came out."""
    tree, both = ways(name)
    for i in range(tree.n_q):
        q = tree.loops.home.copy()
        q[i] = bad
        for way in both:
            with pytest.raises((ClosureError, np.linalg.LinAlgError)):
                way.close(q)
