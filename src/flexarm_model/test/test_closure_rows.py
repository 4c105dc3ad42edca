"""A loop closes the right way round, or is refused: both sides of its joint point alike."""

from __future__ import annotations

from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from finite_difference import assert_jacobian
from four_bar import four_bar, rocker_angle

from flexarm_model.served.loop_closing import close_at
from flexarm_model.tree.closure import find_loops
from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.closure_rows import ClosureRows
from flexarm_model.tree.frame_graph import Closure
from flexarm_model.tree.frames import Motion
from flexarm_model.tree.reduced_tree import ReducedTree

TURN = 2 * np.pi
EXACTLY_BACK = np.degrees(rocker_angle(np.pi / 3)) + 180.0


def closed(folder: Path, guess_deg: float) -> tuple[ReducedTree, float]:
    """Return the linkage closed from a guess of its closing hinge, and where that hinge stands [rad]."""
    config = four_bar(folder, f"rz: {{stiffness: 2 N m/rad, guess: {guess_deg!r} deg}}")
    tree = ReducedTree(config, use_compiler=False)
    return tree, float(tree.loops.home[tree.axis_names.index("ground.rz")])


@pytest.mark.parametrize("guess_deg", [-180.0, -90.0, 0.0, 45.0, 89.0, float(EXACTLY_BACK), 120.0, 180.0])
def test_a_four_bar_closes_as_its_geometry_says_from_any_guess(tmp_path: Path, guess_deg: float) -> None:
    _, ground = closed(tmp_path, guess_deg)
    apart = (ground - rocker_angle(np.pi / 3) + np.pi) % TURN - np.pi
    assert apart == pytest.approx(0.0, abs=1e-10)  # closed to 1e-11 m over 0.1 m


def test_it_stays_the_right_way_round_while_the_crank_turns(tmp_path: Path) -> None:
    tree, _ = closed(tmp_path, 0.0)
    ground = tree.axis_names.index("ground.rz")
    for crank in np.linspace(-2.0, 3.0, 21):
        apart = close_at(tree, np.array([crank]))[ground] - rocker_angle(crank)
        assert (apart + np.pi) % TURN - np.pi == pytest.approx(0.0, abs=1e-9)


def turning(held: tuple[float, ...] = ()) -> ClosureRows:
    """Return the rows of a node that turns about x, y and z, one after the other, by q and then ``held``."""
    q, none = ca.SX.sym("q", 3 - len(held)), ca.SX.zeros(3)
    angles = [*ca.vertsplit(q), *held]
    x, y, z = (ca.SX.eye(3)[:, i] for i in range(3))
    R = ca.SX.eye(3)
    for angle, (axis, other, third) in zip(angles, ((x, y, z), (y, z, x), (z, x, y)), strict=True):
        about = axis @ axis.T + ca.cos(angle) * (other @ other.T + third @ third.T)
        R = R @ (about + ca.sin(angle) * (third @ other.T - other @ third.T))
    ends = {0: Motion(none, ca.SX.eye(3), *[none] * 4), 1: Motion(none, R, *[none] * 4)}
    return ClosureRows((Closure("lid", 0, 1),), ends, q)


@pytest.mark.parametrize("angle", [0.0, 0.5, 2.0, 3.1, -3.1])
def test_the_rows_for_far_away_are_twice_the_sine_of_half_the_turn(angle: float) -> None:
    rows = turning()
    c, _ = rows.far(np.array([0.0, 0.0, angle]))
    assert c == pytest.approx([0, 0, 0, 0, 0, 2 * np.sin(angle / 2)], abs=1e-12)
    assert rows.upside_down(np.array([0.0, 0.0, angle])) == (("lid",) if abs(angle) > np.pi / 2 else ())


def test_their_jacobian_is_their_slope() -> None:
    rows = turning()
    q = np.array([0.4, -0.7, 1.9])
    assert_jacobian(lambda x: rows.near(x)[0], q, rows.near(q)[1])
    assert_jacobian(lambda x: rows.far(x)[0], q, rows.far(q)[1])


def test_a_loop_that_fits_only_upside_down_is_refused_by_name() -> None:
    nothing = np.zeros(0, dtype=np.intp)
    rows = turning((0.0, np.pi))  # however far it turns about x, it stays turned by 180 degrees
    with pytest.raises(ClosureError, match=r"box: at the home pose the loop of lid closes upside down"):
        find_loops(rows, np.zeros(1), np.array([0]), nothing, "box")


@pytest.mark.parametrize(("axes", "share"), [("", "2 of 3"), ("tz: {stiffness: 1e6 N/m}", "3 of 4")])
def test_a_loop_welded_shut_is_told_to_need_passive_axes(tmp_path: Path, axes: str, share: str) -> None:
    config = four_bar(tmp_path, axes)
    with pytest.raises(ClosureError, match=rf"four_bar: the loop of ground .* act on {share} .* needs pass"):
        ReducedTree(config, use_compiler=False)


def test_a_loop_without_any_axis_of_its_own_is_refused_by_name() -> None:
    nothing = np.zeros(0, dtype=np.intp)
    with pytest.raises(
        ClosureError, match="box: the loop of lid is stiff: .* act on 0 of 3 .* passive or spr"
    ):
        find_loops(turning(), np.zeros(3), nothing, nothing, "box")
