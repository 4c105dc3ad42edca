"""A control period in machine code is the one that NumPy computes, looped or not, driven or led."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flexarm_bringup.sim.implicit_parts import find_parts
from flexarm_bringup.sim.implicit_period import MachinePeriod, PlainPeriod, Stepping, make_period
from flexarm_bringup.sim.implicit_steps import ImplicitSteps
from flexarm_model.numeric.compiled import find_compiler
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import find_equilibrium
from flexarm_model.tree.reduced_tree import ReducedTree

H = 4e-4
PERIODS = 10


def tree_of(name: str, use_compiler: bool = True) -> ReducedTree:
    """Return an arm as described."""
    return ReducedTree(load_config(find_manipulator(name)), use_compiler=use_compiler)


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
@pytest.mark.parametrize("is_driven", [True, False])
@pytest.mark.parametrize(
    ("name", "passes"), [("single_link", 1), ("planar_3rrr", 1), ("planar_3rrr", 2), ("spatial_3tpt", 2)]
)
def test_machine_code_and_numpy_move_an_arm_alike(name: str, passes: int, is_driven: bool) -> None:
    tree = tree_of(name)
    stepping = Stepping(H, 3, 0.2, is_driven, passes)
    fast, plain = make_period(tree, stepping), PlainPeriod(tree, stepping)
    assert isinstance(fast, MachinePeriod)
    limits = [axis.effort for axis in tree.config.actuated.values()]
    u = np.random.default_rng(3).standard_normal(len(limits)) * (0.2 * np.array(limits) if is_driven else 1.0)
    q, _ = find_equilibrium(tree, tree.config.home)
    a = b = (q, np.zeros_like(q), np.zeros_like(q))
    for _ in range(PERIODS):
        a, b = fast.advance(*a[:2], u), plain.advance(*b[:2], u)
        for found, expected in zip(a, b, strict=True):  # rounding, as the elimination enlarges it
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * abs(expected).max())
    assert abs(a[1]).max() > 0.0


def test_joints_that_bear_nothing_come_last_and_are_not_carried() -> None:
    tree = tree_of("spatial_3tpt")
    parts = find_parts(tree, (tree.K != 0.0) | (tree.D != 0.0), [])
    names = [tree.coordinates[i] for i in parts.order]
    assert parts.free + tree.n_c == tree.n_q and sorted(names) == sorted(tree.coordinates)
    light = names[parts.free + parts.heavy :]
    assert len(light) == 9 and all(name.startswith("ball_") for name in light)


def test_without_a_compiler_numpy_steps() -> None:
    tree = tree_of("planar_3rrr", use_compiler=False)
    assert isinstance(make_period(tree, Stepping(H, 1, 0.0, True)), PlainPeriod)


def test_a_motion_that_cannot_be_computed_is_refused_as_numpy_refuses_it() -> None:
    tree = tree_of("planar_3rrr")
    steps = ImplicitSteps(tree, H, 1, 0.0)
    wild = np.full(tree.n_q, 1e200)
    with pytest.raises((ValueError, np.linalg.LinAlgError)):
        steps.drive(tree.loops.home, wild, np.zeros(3))


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
def test_friction_of_an_axis_that_bears_nothing_brings_it_to_rest() -> None:
    """Machine code left it out of the matrix: the crank chattered for ever."""
    tree = ReducedTree(load_config(Path(__file__).parent / "arms" / "massless_crank.yaml"))
    stepping = Stepping(1e-3, 1, 0.2, True)
    fast, plain = make_period(tree, stepping), PlainPeriod(tree, stepping)
    assert isinstance(fast, MachinePeriod)
    a = b = (tree.loops.home.copy(), np.zeros(tree.n_q), np.zeros(tree.n_q))
    for k in range(60):
        u = np.array([0.3 if k < 20 else 0.0])
        a, b = fast.advance(*a[:2], u), plain.advance(*b[:2], u)
        np.testing.assert_allclose(a[1], b[1], rtol=0, atol=1e-9)
    assert abs(a[1]).max() < 1e-9


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
def test_a_loop_that_is_led_as_a_whole_asks_nothing_that_is_refused(
    capfd: pytest.CaptureFixture[str],
) -> None:
    """BLAS printed a line in every step, about a matrix of nothing."""
    tree = ReducedTree(load_config(Path(__file__).parent / "arms" / "rigid_four_bar.yaml"))
    period = make_period(tree, Stepping(H, 3, 0.2, False))
    period.advance(tree.loops.home.copy(), np.zeros(tree.n_q), np.ones(1))
    said = capfd.readouterr()
    assert not said.out + said.err


def test_where_some_functions_were_not_compiled_numpy_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """A compiler that ran out of memory at the larger one: the rig ended instead of being slower."""
    tree = tree_of("single_link")
    monkeypatch.setattr(tree.functions["bias"], "library", None)
    assert isinstance(make_period(tree, Stepping(H, 1, 0.0, True)), PlainPeriod)
