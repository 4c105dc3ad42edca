"""Point masses with inertia, box sections, modes up to a frequency, superelements of first order."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from arms import bar
from beam_theory import cantilever

from flexarm_model.bodies.body_reduction import reduce_body, reduce_to_first_order
from flexarm_model.manipulator.body_spec import Beam, PointMass, Reduction
from flexarm_model.reading.config import load_config
from flexarm_model.segments.segments import cut_beam
from flexarm_model.settings.strict_yaml import ConfigError

KINDS = ("bend_y", "bend_z", "torsion", "stretch")
BALL = PointMass("ball", 0.3, 2.0, 0.04)


def reduced(method: str, modes: int = 0, f_max: float = 0.0, **changes: object) -> Beam:
    return replace(bar(KINDS), reduction=Reduction(method, modes, "clamped", f_max=f_max), **changes)  # type: ignore[arg-type]


def test_a_ball_adds_its_own_inertia_about_any_axis() -> None:
    bare, loaded = (reduce_body(reduced("craig_bampton", 4, point_masses=m), {"root"}) for m in ((), (BALL,)))
    moment = [np.trace(b.P[0, 0]) * np.eye(3) - b.P[0, 0] for b in (loaded, bare)]
    steiner = BALL.mass * BALL.at**2 * np.diag([0.0, 1.0, 1.0])
    assert moment[0] - moment[1] == pytest.approx(BALL.inertia * np.eye(3) + steiner, abs=1e-12)
    segments = cut_beam(reduced("craig_bampton", 4, point_masses=(BALL,)), 8)
    about_root = sum(
        s.inertia + s.mass * (s.spring_at + s.com[0]) ** 2 * np.diag([0.0, 1.0, 1.0]) for s in segments
    )
    assert about_root == pytest.approx(moment[0], rel=1e-9, abs=1e-12)


def test_a_heavy_ball_twists_a_light_bar_as_a_torsion_pendulum() -> None:
    """w^2 = G J / (L J_ball), and a stiff ball bends it: the two roots of the 2 x 2 of a cantilever's end."""
    ball = PointMass("ball", 0.5, 40.0, 0.9)
    beam = reduced("craig_bampton", 8, point_masses=(ball,), nodes={"root": 0.0, "end": 0.5})
    piece, L = beam.pieces[0], 0.5
    omega = reduce_body(beam, {"root", "end"}).omega
    twist = np.sqrt(piece.G * piece.torsion_constant / (L * ball.inertia))
    K = piece.E * piece.I_z / L**3 * np.array([[12, -6 * L], [-6 * L, 4 * L**2]])
    bend = np.sqrt(np.linalg.eigvals(np.linalg.solve(np.diag([ball.mass, ball.inertia]), K)))
    for exact in (twist, *bend):
        assert min(abs(omega / exact - 1)) < 1e-3  # the bar's own 54 g


@pytest.mark.parametrize("rotary", [True, False])
def test_sections_turn_for_free_only_where_that_is_said(rotary: bool) -> None:
    """Rayleigh's and Euler-Bernoulli's cantilever differ in bending and twist alike."""
    beam = replace(bar(["bend_z", "torsion"], elements=24), rotary_inertia=rotary)
    beam = replace(beam, reduction=Reduction("craig_bampton", 12, "clamped"))
    piece, L = beam.pieces[0], 0.5
    rho_I = piece.density * piece.I_y if rotary else 0.0
    bending = cantilever(piece.E, piece.I_y, piece.density * piece.area, L, 0.0, L, 4, rho_I).omega
    polar = piece.density * (piece.I_y + piece.I_z)
    twisting = np.pi / 2 / L * np.sqrt(piece.G * piece.torsion_constant / polar)
    omega = reduce_body(beam, {"root"}).omega
    for exact in (*bending, twisting):
        assert min(abs(omega / exact - 1)) < 3e-4  # linear shapes in torsion
    segments = cut_beam(beam, 100)
    assert segments[50].inertia[0, 0] == pytest.approx(polar * L / 100, rel=1e-9)
    thin = piece.density * piece.area * (L / 100) ** 3 / 12 + rho_I * L / 100
    assert segments[50].inertia[1, 1] == pytest.approx(thin, rel=1e-6)


def test_its_modal_mass_is_that_of_the_finite_elements() -> None:
    body = reduce_body(reduced("craig_bampton", 6, point_masses=(BALL,)), {"root"})
    assert body.modal_mass == pytest.approx(np.eye(6), abs=1e-9)


@pytest.mark.slow
def test_modes_up_to_a_frequency_are_the_static_and_those_that_lie_below() -> None:
    clamped = replace(bar(KINDS), reduction=Reduction("craig_bampton", 40, "clamped"))
    interior = reduce_body(clamped, {"root"}).omega / (2 * np.pi)  # nothing kept but the root
    f_max = float(interior[3] + interior[4]) / 2
    assert reduce_body(reduced("craig_bampton", f_max=f_max), {"root"}).n == 4
    assert reduce_body(reduced("craig_bampton", f_max=1.0), {"root", "end"}).n == 6
    static = reduce_body(reduced("craig_bampton", f_max=1.0), {"root", "end"}).omega
    assert reduce_body(reduced("guyan"), {"root", "end"}).omega == pytest.approx(static, rel=1e-12)
    assert reduce_body(reduced("craig_bampton", f_max=np.inf), {"root", "end"}).n == 48  # 8 elements: all


def test_guyan_lets_a_beam_whose_tip_nothing_uses_follow_its_root() -> None:
    body = reduce_body(reduced("guyan", point_masses=(BALL,)), {"root"})
    assert body.n == 0 and body.mass == pytest.approx(BALL.mass + 2700 * 0.00004 * 0.5)


def test_a_superelement_of_first_order_is_the_other_without_its_second_order_fields() -> None:
    beam = reduced("craig_bampton", 6, point_masses=(BALL,))
    full, first = reduce_body(beam, {"root", "end"}), reduce_to_first_order(beam, {"root", "end"})
    assert first.pairs == [] and first.s.shape == (7, 3)
    assert first.s == pytest.approx(full.s[:7], abs=1e-15)
    assert pytest.approx(full.P[:7, :7], abs=1e-15) == first.P
    assert (first.nodes["end"].Phi == full.nodes["end"].Phi).all()


BOX = """
format: flexarm/1
name: box
source: made up
gravity: [0 m/s^2, 0 m/s^2, 0 m/s^2]
bodies:
  beam:
    type: beam
    pieces:
      - length: 1 m
        section: {shape: box, along_y: 120 mm, along_z: 180 mm, wall: WALL}
        youngs_modulus: 70 GPa
        density: 2700 kg/m^3
        elements: 1
    point_masses: [{name: motor, at: 1 m, mass: 1 kg, inertia: 0.25 kg m^2}]
    deformation: [bend_y]
    damping_ratio: 0
    nodes: {end: 1 m}
    reduction: REDUCTION
joints: {weld: {parent: world, child: beam.root}}
tip: beam.end
served: {modes: 0, home: [], rate: 100 Hz}
"""


def written(folder: Path, wall: str = "10 mm", reduction: str = "{method: guyan}") -> Path:
    path = folder / "box.yaml"
    path.write_text(BOX.replace("WALL", wall).replace("REDUCTION", reduction))
    return path


def test_a_box_has_the_section_of_its_walls(tmp_path: Path) -> None:
    beam = load_config(written(tmp_path)).bodies["beam"]
    assert isinstance(beam, Beam)
    [piece], [motor] = beam.pieces, beam.point_masses
    assert piece.area == pytest.approx(0.12 * 0.18 - 0.10 * 0.16)
    y, z, dA = np.linspace(-0.06, 0.06, 1201), np.linspace(-0.09, 0.09, 1801), 1e-8
    y, z = np.meshgrid((y[1:] + y[:-1]) / 2, (z[1:] + z[:-1]) / 2)
    wall = (abs(y) > 0.05) | (abs(z) > 0.08)
    assert piece.I_y == pytest.approx((z**2)[wall].sum() * dA, rel=1e-5)
    assert piece.I_z == pytest.approx((y**2)[wall].sum() * dA, rel=1e-5)
    middle, length = 0.11 * 0.17, 2 * (0.11 + 0.17)  # Bredt: 4 A_m^2 t / s
    assert piece.torsion_constant == pytest.approx(4 * middle**2 * 0.010 / length)
    assert motor.inertia == 0.25


WRONG = [
    ({"wall": "60 mm"}, "section.wall: 0.06: must be below half the narrower side, 0.06 m"),
    (
        {"reduction": "{method: guyan, f_max: 1 kHz}"},
        "reduction.f_max: .* expected alone, with craig_bampton",
    ),
    ({"reduction": "{method: craig_bampton, f_max: 1 kHz, modes: 3}"}, "reduction.f_max: .* expected alone"),
    ({"reduction": "{method: craig_bampton}"}, "reduction.modes: 0: expected a whole number, at least 1"),
]


@pytest.mark.parametrize(("change", "text"), WRONG)
def test_what_makes_no_sense_is_refused_by_name(change: dict[str, str], text: str, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=text):
        load_config(written(tmp_path, **change))
