"""Hinge half-bodies, pinned interfaces and axial rigidity against exact Euler-Bernoulli beams.

A rigid arm of length e at an end moves the hinge by ``w = v + e v'``. Virtual work gives the exact
conditions of the flexible length between two arms, each hinged, or carrying a mass, at its far end.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from arms import BAR, Array, bar, tip_mass
from finite_difference import finite_difference
from scipy.linalg import eigh
from scipy.optimize import brentq

from flexarm_model.bodies.beam import BeamMesh
from flexarm_model.bodies.body_reduction import KeptReductions, reduce_body
from flexarm_model.bodies.superelement import Superelement
from flexarm_model.manipulator.body_spec import Beam, BeamPiece, Reduction
from flexarm_model.manipulator.description import WORLD, Axis, Joint, ManipulatorConfig, NodeRef
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.segments.segments import cut_beam

L, ARM = 0.300, 0.018
EI = {1: 0.200083, 2: 0.220092}  # seed 000, section 2 [N m^2]
RHO_A = {1: 0.30625, 2: 0.23275}  # [kg/m]
STRIP = {
    number: BeamPiece(
        L, 2.45e-5, 35e-3**3 * 0.7e-3 / 12, 0.7e-3**3 * 35e-3 / 12, 1e-12, E, 80e9, rho, elements=16
    )
    for number, E, rho in ((1, 200e9, 12500.0), (2, 220e9, 9500.0))
}
HALF_BODY = BeamPiece(ARM, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0, elements=1, rigid=True)
SECTION = ("area", "I_y", "I_z", "torsion_constant", "E", "G", "density")
Row = Callable[[Array, float], Array]  # a condition over the derivatives 0 to 3 of four functions, (4, 4)


def exact_hz(number: int, at_root: tuple[Row, Row], at_end: tuple[Row, Row]) -> float:
    """Return the first frequency of a uniform beam under four conditions [Hz]."""

    def determinant(k: float) -> float:
        omega2 = k**4 * EI[number] / RHO_A[number]
        root, end = _derivatives(k, 0.0), _derivatives(k, L)
        rows = [*(row(root, omega2) for row in at_root), *(row(end, omega2) for row in at_end)]
        return float(np.linalg.det([row / abs(row).max() for row in rows]))

    waves = np.arange(0.3, 6.0, 0.05) / L
    values = [determinant(k) for k in waves]
    first = next(i for i in range(len(waves) - 1) if values[i] * values[i + 1] < 0)
    k = brentq(determinant, waves[first], waves[first + 1], xtol=1e-13)
    return float(k**2 * np.sqrt(EI[number] / RHO_A[number]) / (2 * np.pi))


def _derivatives(k: float, x: float) -> Array:
    sine, cosine, sh, ch = np.sin(k * x), np.cos(k * x), np.sinh(k * x), np.cosh(k * x)
    rows = [
        [sine, cosine, sh, ch],
        [cosine, -sine, ch, sh],
        [-sine, -cosine, sh, ch],
        [-cosine, sine, ch, sh],
    ]
    return np.array([k**order * np.array(row) for order, row in enumerate(rows)])


CLAMPED: tuple[Row, Row] = (lambda d, _: d[0], lambda d, _: d[1])


def hinged(e: float) -> tuple[Row, Row]:
    """Return the conditions of an end whose hinge lies ``e`` further along x: w = 0, no moment there."""
    return (lambda d, _: d[0] + e * d[1], lambda d, _: d[2] + e * d[3])


def loaded(number: int, e: float, mass: float) -> tuple[Row, Row]:
    """Return the conditions of an end with a mass ``e`` further along x."""
    return (
        lambda d, omega2: EI[number] * d[3] + omega2 * mass * (d[0] + e * d[1]),
        lambda d, omega2: EI[number] * d[2] - omega2 * mass * e * (d[0] + e * d[1]),
    )


def strip(number: int, frame: str, modes: int, arm: float = ARM, interface: str = "pinned") -> Beam:
    """Return a link of seed 000 with a node "tip"; without half-bodies when ``arm`` is zero."""
    half = (replace(HALF_BODY, length=arm),) if arm else ()
    length = L + 2 * arm
    return Beam(
        "strip", (*half, STRIP[number], *half), (), ("bend_y",), 0.0, {"root": 0.0, "tip": length},
        Reduction("craig_bampton", modes, frame, interface=interface),
    )  # fmt: skip


def hinged_at_tip_hz(body: Superelement) -> Array:
    """Return the frequencies with the tip's position held [Hz]."""
    _, _, held = np.linalg.svd(body.nodes["tip"].Phi[1:2])
    N = held[1:].T  # what leaves the tip where it is
    return np.asarray(np.sqrt(eigh(N.T @ body.K @ N, N.T @ N, eigvals_only=True)) / (2 * np.pi))


@pytest.mark.parametrize(("arm", "printed"), [(0.0, 22.04), (ARM, None)])
def test_one_fixed_interface_mode_is_the_clamped_hinged_beam(arm: float, printed: float | None) -> None:
    body = reduce_body(strip(1, "clamped", 2, arm), {"root", "tip"})
    exact = exact_hz(1, CLAMPED, hinged(arm))
    assert hinged_at_tip_hz(body) == pytest.approx([exact], rel=2e-5)
    if printed:
        assert exact == pytest.approx(printed, abs=0.005)
    else:
        assert exact < 0.93 * 22.04  # the half-body lowers it


@pytest.mark.parametrize(("arm", "printed"), [(0.0, 16.97), (ARM, None)])
def test_the_chord_mode_is_the_beam_hinged_at_both_ends(arm: float, printed: float | None) -> None:
    body = reduce_body(strip(2, "chord", 1, arm), {"root", "tip"})
    exact = exact_hz(2, hinged(-arm), hinged(arm))
    assert body.omega / (2 * np.pi) == pytest.approx([exact], rel=2e-5)
    if printed:
        assert exact == pytest.approx(printed, abs=0.005)
    else:
        assert exact < 0.9 * 16.97


def test_the_half_body_at_the_tip_carries_a_mass_as_the_exact_beam_does() -> None:
    beam = strip(1, "clamped", 6)
    beam = replace(beam, point_masses=tip_mass(0.053, beam.length))
    exact = exact_hz(1, CLAMPED, loaded(1, ARM, 0.053))
    assert reduce_body(beam, {"root", "tip"}).omega[0] / (2 * np.pi) == pytest.approx(exact, rel=1e-5)


def test_a_pinned_tip_bends_exactly_under_a_force_and_its_slope_is_left_to_the_modes() -> None:
    """The hinge keeps its position: one boundary displacement where a welded interface has two."""
    pinned = reduce_body(strip(1, "clamped", 1), {"root", "tip"})
    eta = np.linalg.solve(pinned.K, pinned.nodes["tip"].Phi.T @ [0.0, 1.0, 0.0])
    moved, turned = pinned.nodes["tip"].Phi @ eta, pinned.nodes["tip"].Psi @ eta
    arms = L**3 / 3 + L**2 * ARM + L * ARM**2  # int (x_tip - x)^2 dx over the flexible length
    assert moved[1] == pytest.approx(arms / EI[1], rel=1e-4)  # EI to its six printed digits
    assert turned[2] == pytest.approx((L**2 / 2 + L * ARM) / EI[1], rel=1e-4)


def test_a_gauge_beside_a_half_body_reads_the_bending_moment_in_both_trees() -> None:
    at, offset = ARM + 0.010, 0.35e-3
    plain = strip(1, "clamped", 1)
    beam = replace(plain, nodes={**plain.nodes, "gauge": at})
    exact = -offset * (beam.length - at) / EI[1]  # of a push of 1 N across the hinge
    body = reduce_body(beam, {"root", "tip"})
    eta = np.linalg.solve(body.K, body.nodes["tip"].Phi.T @ [0.0, 1.0, 0.0])
    assert -offset * (body.nodes["gauge"].strain @ eta)[1] == pytest.approx(exact, rel=1e-4)
    segments = SegmentTree(on_an_axis(beam), 5)
    springs = np.setdiff1d(np.arange(segments.n_q), segments.actuated)
    tip = NodeRef("strip", "tip")
    J = finite_difference(lambda q: segments.node_pose(q, tip)[1, 3], np.zeros(segments.n_q), 0.01)
    q = np.zeros(segments.n_q)
    q[springs] = J[springs] / np.diag(segments.K)[springs]
    gauge = SensorSpec("g", "strain_gauge", "strip.gauge", ("strain",), np.ones(1), offset=(offset, 0.0))
    assert segments.strain(q, gauge) == pytest.approx(exact, rel=1e-4)


def test_a_rigid_piece_moves_as_one_body_without_strain() -> None:
    nodes = {"root": 0.0, "before": ARM / 2, "near": 0.325, "tip": 0.336, "gauge": 0.1}
    beam = replace(strip(1, "clamped", 3, interface="welded"), nodes=nodes)
    body = reduce_body(beam, {"root", "tip"})
    near, tip = body.nodes["near"], body.nodes["tip"]
    assert abs(body.nodes["before"].Phi).max() == pytest.approx(0.0, abs=1e-12)
    assert near.Psi == pytest.approx(tip.Psi, rel=1e-9)
    assert tip.Phi[1] - near.Phi[1] == pytest.approx(0.011 * tip.Psi[2], rel=1e-9)
    flexible = abs(body.nodes["gauge"].strain).max()
    assert max(abs(near.strain).max(), abs(tip.strain).max()) < 1e-9 * flexible


def test_a_rigid_piece_between_two_flexible_ones_is_not_bent() -> None:
    half = replace(STRIP[1], length=L / 2, elements=4)
    beam = replace(strip(1, "clamped", 2), pieces=(half, HALF_BODY, half), nodes={"root": 0.0, "tip": 0.318})
    body = reduce_body(replace(beam, point_masses=tip_mass(0.05, 0.318)), {"root", "tip"})
    eta = np.linalg.solve(body.K, body.nodes["tip"].Phi.T @ [0.0, 1.0, 0.0])
    compliance = (0.318**3 - (0.318 - L / 2) ** 3 + (L / 2) ** 3) / (3 * EI[1])  # int (x_tip - x)^2 / EI dx
    assert (body.nodes["tip"].Phi @ eta)[1] == pytest.approx(compliance, rel=1e-4)


def test_bending_both_ways_has_the_same_half_bodies() -> None:
    square = replace(STRIP[1], I_y=STRIP[1].I_z)
    beam = replace(
        strip(1, "clamped", 4), pieces=(HALF_BODY, square, HALF_BODY), deformation=("bend_y", "bend_z")
    )
    omega = reduce_body(beam, {"root", "tip"}).omega
    assert omega[::2] == pytest.approx(omega[1::2], rel=1e-9)
    assert omega[::2] == pytest.approx(reduce_body(strip(1, "clamped", 2), {"root", "tip"}).omega, rel=1e-9)


def test_a_beam_whose_rigid_root_piece_carries_an_interface_is_clamped_at_its_root_all_the_same() -> None:
    """The root is the master of its stretch, or nothing would hold the beam."""
    flange = replace(HALF_BODY, elements=2)
    beam = Beam(
        "strip", (flange, STRIP[1]), (), ("bend_y",), 0.0, {"root": 0.0, "flange": ARM / 2, "tip": ARM + L},
        Reduction("craig_bampton", 3, "clamped"),
    )  # fmt: skip
    plain, held = (reduce_body(beam, interfaces).omega for interfaces in (("tip",), ("flange", "tip")))
    np.testing.assert_allclose(held, plain, rtol=1e-6)


def test_a_beam_without_a_flexible_piece_is_refused() -> None:
    with pytest.raises(ValueError, match="body 'strip': no piece of the beam is flexible"):
        BeamMesh(replace(strip(1, "clamped", 1), pieces=(HALF_BODY, HALF_BODY)))


@pytest.mark.parametrize("frame", ["clamped", "chord"])
def test_a_pinned_interface_keeps_the_stretch_of_the_beam(frame: str) -> None:
    """One hinge displacement is left along x: the linear stretch, EA / L against a third of the mass."""
    beam = bar(["bend_y", "stretch"], elements=12, axial_rigidity=5e5, E=200e9)
    modes = {"clamped": 3, "chord": 2}[frame]
    body = reduce_body(
        replace(beam, reduction=Reduction("craig_bampton", modes, frame, interface="pinned")), {"root", "end"}
    )
    mass = BAR.density * BAR.area * BAR.length
    assert body.omega[-1] == pytest.approx(np.sqrt(5e5 / BAR.length / (mass / 3)), rel=1e-9)
    eta = np.linalg.solve(body.K, body.nodes["end"].Phi.T @ [1.0, 0.0, 0.0])
    assert (body.nodes["end"].Phi @ eta)[0] == pytest.approx(BAR.length / 5e5, rel=1e-9)


def test_axial_rigidity_is_that_of_the_segments_springs() -> None:
    beam = bar(["bend_y", "stretch"], axial_rigidity=5e5)
    springs = cut_beam(beam, 5)[1].springs
    assert springs == (
        ("bend_y", "rz", pytest.approx(BAR.E * BAR.I_z / 0.1)),
        ("stretch", "tx", pytest.approx(5e5 / 0.1)),
    )


def test_damping_time_adds_the_stiffness_times_it() -> None:
    beam = replace(strip(1, "clamped", 2), damping_ratio=0.01, damping_time=2e-4)
    body = reduce_body(beam, {"root", "tip"})
    expected = np.diag(0.02 * body.omega + 2e-4 * body.omega**2)
    np.testing.assert_allclose(body.own_damping, expected, rtol=1e-12)


def test_springs_stand_in_flexible_stretches_only() -> None:
    beam = replace(strip(1, "clamped", 2), pieces=(HALF_BODY, STRIP[1], HALF_BODY, HALF_BODY, STRIP[1]))
    segments = cut_beam(beam, 3)
    at = [segment.spring_at for segment in segments[1:]]
    assert at == pytest.approx([0.068, 0.168, 0.268, 0.404, 0.504, 0.604])
    assert [s.springs[0][2] for s in segments[1:]] == pytest.approx([EI[1] / 0.1] * 6, rel=1e-5)
    assert [s.to_next for s in segments] == pytest.approx([0.068, 0.1, 0.1, 0.136, 0.1, 0.1, 0.05])
    assert sum(s.mass for s in segments) == pytest.approx(2 * RHO_A[1] * L)


def test_segments_that_weigh_nothing_have_a_centre_and_no_inertia() -> None:
    beam = bar(density=0.0, point_masses=tip_mass(0.05))
    segments = cut_beam(beam, 4)
    assert [segment.mass for segment in segments] == [0.0] * 4 + [0.05]
    assert [float(s.com[0]) for s in segments] == pytest.approx(
        [s.to_next / 2 for s in segments[:4]] + [segments[4].to_next]
    )
    assert not any(segment.inertia.any() for segment in segments)


def on_an_axis(beam: Beam) -> ManipulatorConfig:
    joint = Joint(
        "base", NodeRef(WORLD, "root"), NodeRef("strip", "root"), np.eye(4), (Axis("rz", actuated=True),)
    )
    return ManipulatorConfig(
        "one_strip", "", "", "", np.zeros(3), {"strip": beam}, (joint,), (), NodeRef("strip", "tip"),
        1, np.zeros(1), 200.0,
    )  # fmt: skip


def test_segments_between_half_bodies_converge_with_order_two() -> None:
    beam = strip(1, "clamped", 2)
    config = on_an_axis(replace(beam, point_masses=tip_mass(0.053, beam.length)))
    exact = exact_hz(1, CLAMPED, loaded(1, ARM, 0.053))
    found = [SegmentTree(config, n).locked_frequencies(np.zeros(n + 1), 1)[0] for n in (4, 8, 16)]
    errors = np.array(found) / (2 * np.pi) / exact - 1
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx(2.0, abs=0.05)
    assert (4 * errors[2] - errors[1]) / 3 == pytest.approx(0.0, abs=1e-5)


def test_segments_carry_the_damping_time() -> None:
    config = on_an_axis(replace(strip(1, "clamped", 2), damping_time=3e-3))
    segments = SegmentTree(config, 4)
    np.testing.assert_allclose(segments.D, 3e-3 * segments.K, rtol=1e-12)


def test_a_body_that_is_kept_is_reduced_again_where_joints_use_other_nodes() -> None:
    """Reduced once for its tip, it would be held at its tip alone for a joint at another node."""
    flange = replace(HALF_BODY, length=0.1, rigid=False, **{n: getattr(STRIP[1], n) for n in SECTION})
    beam = Beam(
        "strip", (flange, STRIP[1]), (), ("bend_y",), 0.0, {"root": 0.0, "mid": 0.1, "tip": 0.1 + L},
        Reduction("guyan", 0, "clamped"),
    )  # fmt: skip
    kept = KeptReductions()
    assert [kept(beam, used).n for used in (("tip",), ("mid", "tip"), ("tip",))] == [2, 4, 2]
    assert kept(beam, ("tip",)) is kept(beam, ("tip",))
