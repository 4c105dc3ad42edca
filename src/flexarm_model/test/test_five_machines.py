"""The five machines in both trees: rigid limit, frequencies, golden values, Jacobians, compiled code."""

from __future__ import annotations

from functools import cache

import numpy as np
import pinocchio as pin
import pytest
from arms import Array, with_modes
from finite_difference import assert_jacobian, finite_difference
from machines import MACHINES, machine, machine_tree, pose_of, reach, rigid_trees, states, states_about_home

from flexarm_model.numeric.compiled import find_compiler
from flexarm_model.numeric.rotation import rotation_vector
from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.served.linearize import find_equilibrium, linearize
from flexarm_model.tree.reduced_tree import ReducedTree

HANDY = [pytest.param(name, marks=pytest.mark.slow) if name == "serial_6r" else name for name in MACHINES]

LOOPS = ("planar_3rrr", "spatial_3tpt")


@pytest.mark.parametrize("name", MACHINES)
def test_with_rigid_bodies_both_trees_are_pinocchios_recursions(name: str) -> None:
    """Over the coordinates of the open tree; springs and dampers aside, which Pinocchio has not."""
    reduced, segments = rigid_trees(name)
    at = [segments.axes[axis] for axis in reduced.axis_names]
    assert sorted(at) == list(range(reduced.n_q)) and segments.n_q == reduced.n_q
    for x in states(reduced, np.zeros(reduced.n_q), 200, 1.5):
        q, v, a = np.zeros((3, reduced.n_q))
        q[at], v[at], a[at] = x
        passive = reduced.K @ x[0] + reduced.D @ x[1]
        f = pin.rnea(segments.model, segments.data, q, v, a)[at]
        for ours in (reduced.functions["inverse_dynamics"](*x), segments.inverse_dynamics(q, v, a)[at]):
            assert abs(np.array(ours) - passive - f).max() < 1e-10 * abs(f).max()
        upper = np.triu(pin.crba(segments.model, segments.data, q))
        M = (upper + np.triu(upper, 1).T)[np.ix_(at, at)]
        assert abs(np.array(reduced.functions["mass_matrix"](x[0])) - M).max() < 1e-10 * abs(M).max()


@pytest.mark.parametrize("name", LOOPS)
def test_rigid_loops_close_alike_and_leave_the_same_motions(name: str) -> None:
    reduced, segments = rigid_trees(name)
    at = [segments.axes[axis] for axis in reduced.axis_names]
    for pose in (machine(name).home, *machine(name).poses.values()):
        q, _ = find_equilibrium(reduced, pose)
        theirs = segments.close(pose)
        assert q == pytest.approx(theirs[at], abs=1e-9)
        N, ours = segments.null_space(theirs)[at], reduced.motions_within(q)
        assert N.shape == ours.shape
        G = reduced.constraints(q)[1]
        assert abs(G @ N).max() < 1e-8 and abs(G @ ours).max() < 1e-8


# segments, modes per beam in the reduced tree, modes compared, how many of them keep to order two (between
# hinges it is four), and what is left
CONVERGENCE = [
    ("single_link", "home", (8, 16, 32), 6, 3, 3, 1e-4),
    ("planar_3rrr", "home", (8, 16, 32), 5, 9, 9, 1e-5),
    ("planar_3rrr", "A", (8, 16, 32), 5, 9, 9, 1e-5),
    ("spatial_3tpt", "home", (8, 16, 32), 8, 9, 2, 2e-4),
    pytest.param("serial_6r", "mid", (2, 4, 8), 12, 7, 7, 2e-5, marks=pytest.mark.slow),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "label", "segments", "modes", "count", "regular", "rel"), CONVERGENCE)
def test_segment_frequencies_converge_with_order_two_onto_the_reduced_trees(
    name: str, label: str, segments: tuple[int, ...], modes: int, count: int, regular: int, rel: float
) -> None:
    config, pose = machine(name), pose_of(name, label)
    exact = linearize(ReducedTree(with_modes(config, modes, 16), use_compiler=False), pose, count).omega
    found = []
    for n in segments:
        chain = SegmentTree(config, n)
        found.append(chain.locked_frequencies(chain.settle(pose), count))
    change = abs(np.diff(found, axis=0))
    order = np.log2(change[0] / change[1])
    assert np.all(order > 1.7) and np.all(order[:regular] < 2.3)
    assert (4 * found[2] - found[1]) / 3 == pytest.approx(exact, rel=rel)


@pytest.mark.parametrize("label", ["home", "shoulder_down", "elbow_bent", "turned"])
def test_without_beams_both_trees_have_the_same_frequencies(label: str) -> None:
    pose, segments = pose_of("variable_stiffness", label), SegmentTree(machine("variable_stiffness"), 1)
    omega = linearize(machine_tree("variable_stiffness"), pose).omega
    assert segments.locked_frequencies(segments.settle(pose), 3) == pytest.approx(omega, rel=1e-9)


def test_the_symmetric_3rrr_has_exact_doublets() -> None:
    home = machine("planar_3rrr").home
    segments = SegmentTree(machine("planar_3rrr"), 8)
    for omega in (
        linearize(machine_tree("planar_3rrr"), home, 9).omega,
        segments.locked_frequencies(segments.settle(home), 9),
    ):
        for one, other in ((0, 1), (4, 5), (6, 7)):
            assert omega[one] == pytest.approx(omega[other], rel=1e-8)  # the description has nine digits
        for one, other in ((1, 2), (3, 4), (5, 6), (7, 8)):
            assert omega[other] > omega[one] * 1.004  # the others are apart


# seed 000, section 4: beam elements, 8 per link [Hz]
GOLDEN = {
    "A": (1.4041, 1.6819, 1.9102, 13.6052, 13.8773, 14.5651, 20.2382, 20.4087, 20.7244),
    "B": (1.3934, 1.7404, 1.8612, 13.5930, 13.9307, 14.5020, 20.2266, 20.5324, 20.5848),
    "home": (1.6037, 1.6037, 1.8580, 13.6248, 14.1310, 14.1310, 20.4084, 20.4084, 20.5392),
}


@cache
def fine_3rrr() -> ReducedTree:
    """Return 8 elements per strip and enough modes that only these count."""
    return ReducedTree(with_modes(machine("planar_3rrr"), 5, 8), use_compiler=False)


@pytest.mark.slow
@pytest.mark.parametrize("label", GOLDEN)
def test_golden_frequencies_of_the_3rrr(label: str) -> None:
    config, pose, golden = machine("planar_3rrr"), pose_of("planar_3rrr", label), np.array(GOLDEN[label])
    digits = 0.5e-4 / golden  # of the printed values
    segments = SegmentTree(config, 16)
    chain = segments.locked_frequencies(segments.settle(pose), 9) / (2 * np.pi)
    assert np.all(abs(chain / golden - 1) < 0.0025)
    served = linearize(machine_tree("planar_3rrr"), pose).omega / (2 * np.pi)
    assert np.all(abs(served / golden - 1) < 0.001)
    beams = linearize(fine_3rrr(), pose, 9).omega / (2 * np.pi)
    assert np.all(abs(beams / golden - 1) < 0.0001 + digits)


@pytest.mark.parametrize("name", HANDY)
def test_tip_jacobians_are_derivatives_with_the_loops_closed(name: str) -> None:
    arm_tree, scale = machine_tree(name), reach(machine_tree(name))
    q = states_about_home(name, 1, 0.02)[0, 0]
    R, J = arm_tree.tip_pose(q)[:3, :3], arm_tree.tip_jacobian(q)
    assert_jacobian(lambda x: arm_tree.tip_pose(x)[:3, 3], q, J[:3], scale)
    assert_jacobian(lambda x: rotation_vector(arm_tree.tip_pose(x)[:3, :3] @ R.T), q, J[3:], scale)


@pytest.mark.parametrize("name", LOOPS)
def test_rows_of_the_loops_and_their_stiffness_are_derivatives(name: str) -> None:
    arm_tree, scale = machine_tree(name), reach(machine_tree(name))
    q = states_about_home(name, 1, 0.3)[0, 0]
    force = np.random.default_rng(2).normal(0, 1, arm_tree.n_c)
    assert_jacobian(lambda x: arm_tree.constraints(x)[0], q, arm_tree.constraints(q)[1], scale)
    K = np.array(arm_tree.functions["constraint_stiffness"](q, force))
    assert_jacobian(lambda x: arm_tree.constraints(x)[1].T @ force, q, K, scale)


@pytest.mark.parametrize("name", MACHINES)
def test_linearisations_are_derivatives_of_the_inverse_dynamics(name: str) -> None:
    functions, scale = machine_tree(name).functions, reach(machine_tree(name))
    forces = functions["inverse_dynamics"]
    q = states_about_home(name, 1, 0.3)[0, 0]
    rest = np.zeros(q.size)
    M, D, K, f0 = machine_tree(name).linearisation(q)
    assert f0 == pytest.approx(np.array(forces(q, rest, rest)), rel=1e-12, abs=1e-15)
    assert_jacobian(lambda x: forces(q, rest, x), rest, M, scale)
    assert_jacobian(lambda x: forces(x, rest, rest), q, K, scale)
    numeric = finite_difference(lambda x: forces(q, x, rest), rest, scale)
    assert abs(D - numeric).max() < 1e-8 * np.linalg.norm(K)


@pytest.mark.parametrize("name", MACHINES)
def test_output_rows_are_derivatives_of_the_outputs(name: str) -> None:
    functions, scale = machine_tree(name).functions, reach(machine_tree(name))
    outputs = functions["outputs"]
    q = states_about_home(name, 1, 0.3)[0, 0]
    rest = np.zeros(q.size)
    y0, C_pos, C_vel, C_acc = (np.array(part) for part in functions["output_rows"](q))
    assert y0 == pytest.approx(np.array(outputs(q, rest, rest, q)), rel=1e-12, abs=1e-14)
    assert_jacobian(lambda x: outputs(x, rest, rest, q), q, C_pos, scale)
    assert_jacobian(lambda x: outputs(q, rest, x, q), rest, C_acc, scale)
    numeric = finite_difference(lambda x: outputs(q, x, rest, q), rest, scale)
    assert abs(C_vel - numeric).max() < 1e-9 * np.linalg.norm(C_pos)


def arguments(arm_tree: ReducedTree, state: Array) -> dict[str, tuple[Array, ...]]:
    """Return what every function of a tree is asked."""
    q, v, a = state
    asked: dict[str, tuple[Array, ...]] = dict.fromkeys(arm_tree.functions, (q,))
    asked |= {"inverse_dynamics": (q, v, a), "bias": (q, v), "motion": (q, v), "outputs": (q, v, a, q)}
    if arm_tree.n_c:
        return asked | {"constraint_stiffness": (q, a[: arm_tree.n_c])}
    return asked | {"forward_dynamics": (q, v, a)}


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
@pytest.mark.parametrize("name", [pytest.param(name, marks=pytest.mark.slow) for name in MACHINES])
def test_compiled_and_interpreted_results_are_equal(name: str) -> None:
    """To 1e-12 of the largest entry: the compiler may order sums otherwise."""
    fast, slow = ReducedTree(machine(name)), machine_tree(name)
    for state in states_about_home(name, 5, 0.3):
        for function, inputs in arguments(slow, state).items():
            ours, theirs = (arm_tree.functions[function](*inputs) for arm_tree in (fast, slow))
            if not isinstance(ours, tuple):
                ours, theirs = (ours,), (theirs,)
            for one, other in zip(ours, theirs, strict=True):
                other = np.array(other)
                assert abs(np.array(one) - other).max() <= 1e-12 * max(abs(other).max(), 1e-9), function
