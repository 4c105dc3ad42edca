"""The linear assembly against the reduced tree, finite elements of whole structures, and statics."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arms import Array, arm, bar
from beam_theory import cantilever
from rigid_arms import rigid_version
from scipy.linalg import eigh

from flexarm_model.bodies.model_order import (
    FULL,
    with_elements,
    with_modes_below,
    with_rigid_beams,
    with_static_modes,
)
from flexarm_model.manipulator.body_spec import Beam, Reduction
from flexarm_model.manipulator.description import WORLD, Axis, Joint, ManipulatorConfig, NodeRef
from flexarm_model.served.linear_assembly import LinearAssembly, assemble
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

OPEN, CLOSED = ["single_link", "planar", "spatial"], ["four_bar", "five_bar"]


def weightless(name: str) -> ManipulatorConfig:
    return replace(arm(name), gravity=np.zeros(3))


def locked_omega(model: LinearAssembly) -> Array:
    M, _, K = model.locked()
    return np.sqrt(np.maximum(eigh(K, M, eigvals_only=True), 0.0))


@pytest.mark.parametrize("name", OPEN + CLOSED)
def test_it_has_the_frequencies_the_motors_inertia_and_the_damping_of_the_tree(name: str) -> None:
    config = weightless(name)
    tree = ReducedTree(config, use_compiler=False)
    built = assemble(config, dict(zip(config.axes, linearize(tree, modes=1).q0, strict=False)))
    served = linearize(tree, modes=built.n - len(config.actuated))
    rel = 1e-9 if name in OPEN else 1e-7  # the tree's loops are closed by iteration
    assert locked_omega(built)[: served.n_eta] == pytest.approx(served.omega, rel=rel)
    felt = [m.B.T @ np.linalg.solve(m.M, m.B) for m in (built, served)]
    assert felt[0] == pytest.approx(felt[1], rel=1e-6, abs=1e-6 * abs(felt[1]).max())
    M, D, K = built.locked()
    Phi = eigh(K, M)[1][:, : served.n_eta]
    modal = np.diag(Phi.T @ D @ Phi)
    assert modal == pytest.approx(2 * served.zeta * served.omega, rel=1e-6, abs=1e-6 * modal.max(initial=1.0))


@pytest.mark.parametrize("name", OPEN)
def test_without_loops_its_matrices_are_those_of_the_tree(name: str) -> None:
    config = weightless(name)
    tree = ReducedTree(config, use_compiler=False)
    built = assemble(config)
    q = np.zeros(tree.n_q)
    q[tree.actuated] = config.home
    M, D, K, _ = (np.array(part) for part in tree.linearisation(q))
    assert built.coordinates == tree.coordinates
    for ours, theirs in ((built.M, M), (built.K, K), (built.D, D)):
        assert ours == pytest.approx(theirs, abs=1e-9 * max(abs(theirs).max(), 1.0))


@pytest.mark.slow
def test_a_node_moves_as_the_tool_of_the_tree() -> None:
    config = arm("spatial")
    tree, built = ReducedTree(config, use_compiler=False), assemble(config)
    q = np.zeros(tree.n_q)
    q[tree.actuated] = config.home
    assert built.node_rows(config.tip) == pytest.approx(tree.tip_jacobian(q), abs=1e-12)
    assert built.node_rows("fore.end") is built.rows["fore.end"]


@pytest.mark.slow
def test_its_weight_is_the_force_that_holds_the_tree_still() -> None:
    config = arm("spatial")
    tree = ReducedTree(config, use_compiler=False)
    q = np.zeros(tree.n_q)
    q[tree.actuated] = config.home
    held = np.array(tree.functions["inverse_dynamics"](q, 0 * q, 0 * q)).ravel()
    assert assemble(config).gravity_force == pytest.approx(held, abs=1e-9 * abs(held).max())


@pytest.mark.parametrize("name", ["planar", "spatial"])
def test_rigid_beams_leave_the_rigid_arm(name: str) -> None:
    config = arm(name)
    ours, theirs = with_rigid_beams(config), rigid_version(config)
    M = [assemble(item).M for item in (ours, theirs)]
    assert M[0] == pytest.approx(M[1], rel=1e-9)
    assert all(sensor.kind != "strain_gauge" for sensor in ours.sensors)


def chain(cuts: int) -> ManipulatorConfig:
    """Return a cantilever welded of equal beams."""
    piece = replace(bar().pieces[0], length=0.5 / cuts, elements=8 // cuts)
    beam = replace(bar(["bend_y", "stretch"]), pieces=(piece,), nodes={"root": 0.0, "end": piece.length},
                   reduction=Reduction("craig_bampton", 0, "clamped", f_max=FULL))  # fmt: skip
    bodies = {f"beam{i}": replace(beam, name=f"beam{i}") for i in range(cuts)}
    ends = [NodeRef(WORLD, "root"), *(NodeRef(f"beam{i}", "end") for i in range(cuts))]
    joints = [Joint(f"weld{i}", ends[i], NodeRef(f"beam{i}", "root"), np.eye(4), ()) for i in range(cuts)]
    return replace(
        arm("planar"), bodies=dict(bodies), joints=tuple(joints), sensors=(), tip=ends[-1], home=np.zeros(0)
    )


def test_full_beams_welded_together_are_one_beam() -> None:
    one, four = (locked_omega(assemble(chain(cuts))) for cuts in (1, 4))
    assert four == pytest.approx(one, rel=1e-9)
    piece = bar().pieces[0]
    rho_A, rho_I = piece.density * piece.area, piece.density * piece.I_z
    exact = cantilever(piece.E, piece.I_z, rho_A, 0.5, 0.0, 0.5, 2, rho_I)
    assert four[:2] == pytest.approx(exact.omega, rel=1e-4)


def test_reductions_come_down_to_the_full_elements_from_above() -> None:
    def first(config: ManipulatorConfig) -> Array:
        return locked_omega(assemble(config))[:3]

    config = weightless("spatial")
    of_elements = locked_omega(assemble(with_modes_below(config, FULL)))
    full = of_elements[:3]
    rounding = np.finfo(float).eps * (of_elements[-1] / full) ** 2  # of the eigenvalues: norm by eigenvalue
    errors = [first(with_static_modes(config))] + [
        first(with_modes_below(config, f_max)) for f_max in (200.0, 2000.0)
    ]
    static, low, high = (abs(omega / full - 1).max() for omega in errors)
    assert static > low > high and high < 1e-4
    assert all((omega >= full * (1 - rounding)).all() for omega in errors)


def test_finite_elements_converge_with_order_four() -> None:
    """Cubic shapes: the error of a frequency falls with h^4."""
    omega = [
        locked_omega(assemble(with_modes_below(with_elements(weightless("planar"), n), FULL)))[2]
        for n in (2, 4, 16)
    ]
    coarse, fine = omega[0] / omega[2] - 1, omega[1] / omega[2] - 1
    assert np.log2(coarse / fine) == pytest.approx(4.0, abs=0.4)


def test_a_spring_under_a_closed_loop_holds_with_all_its_axes() -> None:
    """A bar between two welds, one of them sprung, is as stiff as bar and spring in a row."""
    config = chain(1)
    EA, k = bar().pieces[0].E * bar().pieces[0].area, 3e6
    end = np.eye(4)
    end[0, 3] = 0.5
    rail = Joint("rail", NodeRef(WORLD, "root"), NodeRef("beam0", "end"), end, (Axis("tx", stiffness=k),))
    slide = replace(config.joints[0], axes=(Axis("tx", actuated=True),))
    built = assemble(replace(config, joints=(slide,), closures=(rail,), home=np.zeros(1)))
    M, _, K = built.locked()
    force = built.K[0, 0] - built.K[0, 1:] @ np.linalg.solve(K, built.K[1:, 0])
    assert built.coordinates[:2] == ("weld0.tx", "free.1") and built.n == 1 + M.shape[0]
    assert force == pytest.approx(1 / (0.5 / EA + 1 / k), rel=1e-9)


def test_a_gaping_loop_and_unknown_axes_are_refused() -> None:
    config = weightless("four_bar")
    motor = next(iter(config.actuated))
    with pytest.raises(ValueError, match="the loop does not close: joint '.*' gapes by"):
        assemble(config, {motor: 0.3})
    with pytest.raises(KeyError, match="no axis 'wheel.rz'; known: "):
        assemble(config, {"wheel.rz": 0.0})


def test_each_call_may_reduce_its_own_way() -> None:
    beams = [body for body in arm("spatial").bodies.values() if isinstance(body, Beam)]
    full = assemble(with_modes_below(arm("spatial"), FULL))
    assert full.n == 3 + sum(5 * sum(p.elements for p in beam.pieces) for beam in beams)
