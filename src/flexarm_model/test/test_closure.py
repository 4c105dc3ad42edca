"""Loops of the reduced tree: which coordinates follow, and what is refused."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from arms import arm
from four_bar import CRANK, GROUND, four_bar
from machines import machine, machine_tree

from flexarm_model.reading.config import load_config
from flexarm_model.served.loop_closing import close_at
from flexarm_model.tree.closure import _choose_dependent, close_loops, null_space, solve_positions
from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.reduced_tree import ReducedTree

LOOPED = ("planar_3rrr", "spatial_3tpt")


@pytest.mark.parametrize("name", LOOPED)
def test_loose_axes_follow_and_sprung_ones_keep_still(name: str) -> None:
    tree = machine_tree(name)
    assert tree.n_c == tree.loops.dependent.size
    assert all(tree.axes[i].stiffness == 0 and not tree.axes[i].actuated for i in tree.loops.dependent)


def test_moving_the_drives_does_not_turn_a_platform_on_springs() -> None:
    config, tree = machine("spatial_3tpt"), machine_tree("spatial_3tpt")
    q = close_at(tree, config.poses["lateral"])
    sprung = [i for i, axis in enumerate(tree.axes) if axis.stiffness]
    assert sprung and abs(q[sprung]).max() == 0.0
    shift = tree.tip_pose(q)[:3, 3] - tree.tip_pose(tree.loops.home)[:3, 3]
    assert np.linalg.norm(shift) == pytest.approx(0.04, rel=1e-6)


@pytest.mark.parametrize("name", LOOPED)
def test_motions_within_the_loops_keep_them_closed(name: str) -> None:
    tree = machine_tree(name)
    q = tree.loops.home
    c, G = tree.constraints(q)
    N = tree.motions_within(q)
    n = len(tree.actuated)
    assert abs(c).max() < 1e-10 and abs(G @ N).max() < 1e-12
    assert np.array_equal(N[tree.actuated][:, :n], np.eye(n)) and not N[tree.actuated][:, n:].any()
    assert np.linalg.matrix_rank(N) == tree.n_q - tree.n_c


@pytest.mark.parametrize("name", LOOPED)
def test_a_disturbed_position_is_closed_again(name: str) -> None:
    tree = machine_tree(name)
    q = tree.loops.home.copy()
    q[tree.actuated] += 0.01
    closed = tree.closed(q)
    free = np.setdiff1d(np.arange(tree.n_q), tree.loops.dependent)
    assert abs(tree.constraints(closed)[0]).max() < 1e-10
    assert np.array_equal(closed[free], q[free])


def test_legs_that_cannot_reach_are_refused_by_name() -> None:
    tree = machine_tree("planar_3rrr")
    q = tree.loops.home.copy()
    q[tree.actuated] += [3.0, 0.0, 0.0]
    with pytest.raises(
        ClosureError, match=r"planar_3rrr: .* this pose: \d\S* m or rad stay open after 50 iter"
    ):
        close_loops(tree.constraints, q, tree.loops.dependent, "planar_3rrr")


def test_a_home_that_cannot_close_is_refused_with_its_gap() -> None:
    rows = np.array([0.25]), np.array([[0.0, 0.0]])
    with pytest.raises(
        ClosureError, match=r"at home the loops do not close: 0.25 m or rad stay open after 50 it"
    ):
        solve_positions(lambda q: rows, np.zeros(2), np.array([0]), "at home")


def test_a_home_where_a_loop_cannot_close_names_loop_gap_and_what_to_change(tmp_path: Path) -> None:
    """The bars are 0.55 m long together, the pivots 0.64 m apart."""
    four_bar(tmp_path)
    path = tmp_path / "four_bar.yaml"
    path.write_text(path.read_text().replace("position: [0.3 m", "position: [0.68 m"), encoding="utf-8")
    said = (
        r"four_bar: at the home pose the loop of ground does not close: its ends are still (0\.\d+) m apart, "
    )
    with pytest.raises(ClosureError, match=rf"^{said}.*; set the 'guess' of .*, move 'home' .*") as caught:
        ReducedTree(load_config(path), use_compiler=False)
    found = re.match(said, str(caught.value))
    assert found and float(found[1]) >= 0.085  # what the bars are too short by


def test_the_gap_of_a_loop_is_how_far_its_ends_are_and_how_much_they_are_turned(tmp_path: Path) -> None:
    """What turns about the pin by an angle a goes by 2 sin(a/2) times its distance from there."""
    tree, angle = ReducedTree(four_bar(tmp_path), use_compiler=False), 2.0  # rad, past 90 degrees
    q = tree.loops.home.copy()
    q[tree.axis_names.index("pin.rz")] += angle
    pin = CRANK * np.array([np.cos(q[0]), np.sin(q[0])])
    distance = float(np.linalg.norm([GROUND, 0.0] - pin))
    assert tree._rows.gaps(q)["ground"] == pytest.approx((2 * np.sin(angle / 2) * distance, angle), rel=1e-9)


def test_a_loop_that_moves_with_the_motors_held_is_singular() -> None:
    G = np.array([[1.0, 0.5, 0.5, 0.0], [2.0, 1.0, 1.0, 1e-9]])
    with pytest.raises(ClosureError, match="here is singular"):
        null_space(G, [0], "here")


def test_an_open_arm_has_nothing_to_close() -> None:
    tree = ReducedTree(arm("planar"), use_compiler=False)
    q = np.arange(tree.n_q) * 0.01
    assert (
        tree.n_c == 0
        and tree.closed(q) is q
        and np.array_equal(np.sort(tree.motions_within(q), axis=0)[-1], np.ones(tree.n_q))
    )


def test_a_far_step_is_shortened_so_that_closing_arrives() -> None:
    """Newton's iteration on the arc tangent runs away from anywhere beyond 1.39."""

    def rows(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return np.arctan(q[1:] - q[0]), np.array([[-1.0, 1.0]]) / (1.0 + (q[1] - q[0]) ** 2)

    found = close_loops(rows, np.array([0.5, 6.0]), np.array([1]), "slope")
    np.testing.assert_allclose(found, [0.5, 0.5], atol=1e-10)


def test_a_sprung_axis_follows_where_the_loose_ones_do_not_reach_not_where_it_is_strongest() -> None:
    G = np.array([[1.0, 5.0, 0.0], [0.0, 0.1, 0.2]])  # the strong spring does what the loose axis does
    assert _choose_dependent(G, np.array([0]), np.array([1, 2])).tolist() == [0, 2]
