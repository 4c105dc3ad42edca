"""One tree serves several threads at once; each has the numbers that it asked for."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import casadi as ca
import numpy as np
import pytest
from arms import arm
from machines import machine

from flexarm_model.numeric.compiled import compile_functions
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

THREADS = 4


@pytest.fixture
def hasty() -> Iterator[None]:
    """Let threads take turns after 1 us instead of 5 ms: what they can spoil is spoilt at once."""
    usual = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(usual)


def in_threads(call: Callable[[Any], Any], points: list[Any]) -> list[Any]:
    with ThreadPoolExecutor(THREADS) as pool:
        return list(pool.map(call, points))


@pytest.mark.parametrize("use_compiler", [True, False])
def test_a_call_in_another_thread_leaves_a_result_as_it_is(use_compiler: bool) -> None:
    x = ca.SX.sym("x", 2)
    f = compile_functions({"f": ca.Function("f", [x], [2.0 * x])}, use_compiler)["f"]
    ours = f(np.ones(2))
    with ThreadPoolExecutor(1) as pool:
        theirs = pool.submit(lambda: f(np.full(2, 5.0)).copy()).result()
    assert ours.tolist() == [2.0, 2.0] and theirs.tolist() == [10.0, 10.0]
    assert f.inputs[0].tolist() == [1.0, 1.0] and f.outputs[0] is ours


@pytest.mark.usefixtures("hasty")
@pytest.mark.parametrize("use_compiler", [True, False])
def test_threads_that_share_a_tree_get_the_same_models_as_one(use_compiler: bool) -> None:
    tree = ReducedTree(arm("single_link"), use_compiler=use_compiler)
    poses = [np.array([angle]) for angle in np.linspace(-1.0, 1.0, 150)]
    alone = [linearize(tree, pose).model_id for pose in poses]
    assert [model.model_id for model in in_threads(lambda pose: linearize(tree, pose), poses)] == alone


@pytest.mark.usefixtures("hasty")
def test_threads_that_share_an_arm_with_loops_close_them_alike() -> None:
    tree = ReducedTree(machine("planar_3rrr"))
    points = np.tile(tree.loops.home, (200, 1))
    points[:, tree.actuated] += np.random.default_rng(3).uniform(-0.02, 0.02, (200, len(tree.actuated)))
    alone = [tree.tip_jacobian(q) for q in points]
    np.testing.assert_array_equal(in_threads(tree.tip_jacobian, list(points)), alone)
