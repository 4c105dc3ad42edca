"""The tip in machine code: the same as with NumPy, and as honest where the loops do not close."""

from pathlib import Path

import numpy as np
import pytest
from machines import machine

from flexarm_estimator.filter import Belief
from flexarm_estimator.tool.machine_tip import MachineTip, make_tip
from flexarm_estimator.tool.rotation_log import exp_rotation, log_rotation
from flexarm_estimator.tool.tip import PlainTip
from flexarm_model.numeric.compiled import find_compiler
from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.closing import RATES, MachineClosing
from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.reduced_tree import ReducedTree

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
ARMS = Path(__file__).resolve().parents[2] / "flexarm_bringup" / "test" / "arms"
BEYOND = 3  # states that are not of the arm: disturbances, biases


def both_ways(name):
    """Return the tip of a machine's served model in machine code and with NumPy, and a state at rest."""
    tree = ReducedTree(machine(name))
    model = linearize(tree)
    n_x = 2 * model.n + BEYOND
    tip = make_tip(model, tree, n_x)
    assert isinstance(tip, MachineTip)
    return tip, PlainTip(model, tree), np.append(model.xi0, np.zeros(n_x - model.n)), model.n


@pytest.mark.parametrize("name", ["single_link", "planar_3rrr"])
def test_machine_code_and_numpy_say_the_same_of_the_tip(name):
    """Poses agree to what closing leaves open, 1e-11; covariances to rounding."""
    fast, plain, rest, _ = both_ways(name)
    rng = np.random.default_rng(3)
    for _ in range(4):
        x, root = rest + 1e-3 * rng.normal(size=rest.size), rng.normal(size=(rest.size, rest.size))
        (T, J), (T_plain, J_plain) = fast.locate(x), plain.locate(x)
        np.testing.assert_allclose(T, T_plain, atol=1e-10)
        np.testing.assert_allclose(J, J_plain, atol=1e-9 * abs(J_plain).max())
        np.testing.assert_array_equal(fast.pose(x), T)
        said, expected = (tip.describe(Belief(x, root @ root.T)) for tip in (fast, plain))
        for part, wanted in zip(said, expected, strict=True):
            np.testing.assert_allclose(part, wanted, rtol=1e-9, atol=1e-9 * np.max(np.abs(wanted)))


@pytest.mark.parametrize("name", ["single_link", "planar_3rrr"])
def test_machine_code_and_numpy_see_the_tip_at_the_same_place(name):
    """Where x = gain y + constant; what was seen before stays as it was."""
    fast, plain, rest, _ = both_ways(name)
    rng = np.random.default_rng(4)
    gain = 1e-3 * rng.normal(size=(rest.size, 5))
    sights = [tip.sight(gain, rest) for tip in (fast, plain)]
    numbers = [rng.normal(size=5) for _ in range(4)]
    seen, expected = ([sight.position(y.tolist()) for y in numbers] for sight in sights)
    np.testing.assert_allclose(seen, expected, atol=1e-10)
    np.testing.assert_allclose(expected, [plain.pose(gain @ y + rest)[:3, 3] for y in numbers], atol=1e-12)
    assert np.ptp(seen, axis=0).max() > 1e-4  # it has moved


@pytest.mark.parametrize("name", ["single_link", "planar_3rrr"])
@pytest.mark.parametrize("angle", [0.0, 1e-9, 1e-3, 0.5, 2.6, 2.8, np.pi])
def test_machine_code_and_numpy_compare_a_pose_alike(name, angle):
    """Up to half a turn, where machine code leaves it to NumPy; ``angle`` is from the tip to the pose."""
    fast, plain, rest, _ = both_ways(name)
    rng = np.random.default_rng(5)
    x, axis = rest + 1e-3 * rng.normal(size=rest.size), np.array([0.36, -0.48, 0.8])
    T = plain.pose(x)
    y = np.concatenate([T[:3, 3] + rng.normal(size=3), log_rotation(exp_rotation(angle * axis) @ T[:3, :3])])
    (nu, J), (expected, J_plain) = fast.compare(y, x), plain.compare(y, x)
    if angle == np.pi and nu[3:] @ expected[3:] < 0.0:  # rounding says which of two vectors it is
        expected[3:] *= -1.0
    np.testing.assert_allclose(nu, expected, atol=1e-7 if angle > 3.0 else 1e-10)  # a square root there
    np.testing.assert_allclose(J, J_plain, atol=1e-9 * abs(J_plain).max())
    assert np.linalg.norm(nu[3:]) == pytest.approx(angle, abs=1e-7)


def test_what_was_said_of_a_tip_does_not_change_when_the_next_is_described():
    fast, _, rest, _ = both_ways("single_link")
    report = fast.describe(Belief(rest, np.eye(rest.size)))
    pose, covariance = report.T_world_tip.copy(), report.cov_pose.copy()
    fast.describe(Belief(rest + 0.1, 2.0 * np.eye(rest.size)))
    np.testing.assert_array_equal(report.T_world_tip, pose)
    np.testing.assert_array_equal(report.cov_pose, covariance)


def test_loops_that_do_not_close_leave_no_sigma_and_raise_as_with_numpy():
    fast, plain, rest, n = both_ways("planar_3rrr")
    wild = rest.copy()
    wild[:n] += 40.0
    for tip in (fast, plain):
        with pytest.raises(ClosureError):
            tip.locate(wild)
        with pytest.raises(ClosureError):
            tip.compare(np.zeros(6), wild)
        with pytest.raises(ClosureError):
            tip.sight(np.zeros((rest.size, 1)), wild).position([0.0])
        report = tip.describe(Belief(wild, np.eye(rest.size)))
        for told in (report.sigma, report.T_world_tip, report.twist, report.cov_pose, report.cov_twist):
            assert np.isnan(told).all() or (told is report.T_world_tip and np.isnan(told[:3]).all())


@pytest.mark.filterwarnings("ignore:invalid value")  # of NumPy
def test_a_state_or_covariance_that_is_not_finite_leaves_no_sigma():
    for tip in both_ways("single_link")[:2]:
        size = both_ways("single_link")[2].size
        for x, P in ((np.full(size, np.nan), np.eye(size)), (np.zeros(size), np.full((size, size), np.inf))):
            assert np.isnan(tip.describe(Belief(x, P)).sigma)


def test_the_rows_of_a_tip_fit_into_a_loop_of_fewer_coordinates():
    """A four-bar has four; what follows its loops had room for as many rows, and six were written."""
    tree = ReducedTree(load_config(ARMS / "rigid_four_bar.yaml"))
    closing, m = tree.closing, tree.n_c
    assert isinstance(closing, MachineClosing) and tree.n_q < RATES
    assert closing._work.size >= m * (m + RATES)
    model = linearize(tree)
    x = np.append(model.xi0, np.zeros(model.n + BEYOND))
    (T, J), (T_plain, J_plain) = (
        tip.locate(x) for tip in (make_tip(model, tree, x.size), PlainTip(model, tree))
    )
    np.testing.assert_allclose(T, T_plain, atol=1e-10)
    np.testing.assert_allclose(J, J_plain, atol=1e-9)
