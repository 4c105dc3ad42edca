"""A beam to second order: against the line integrated from its curvatures, and blades that tip over."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation

from flexarm_model.bodies.beam import BeamMesh
from flexarm_model.bodies.beam_second_order import SecondOrder
from flexarm_model.bodies.beam_superelement import _modes
from flexarm_model.manipulator.body_spec import Beam, BeamPiece, Reduction
from flexarm_model.numeric.rotation import skew
from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import PoseError, linearize
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
LENGTH, AT = 0.7, 0.45  # m
PIECE = BeamPiece(
    length=LENGTH, area=1.2e-4, I_y=9e-11, I_z=1.6e-8, torsion_constant=3.4e-10,
    E=70e9, G=26e9, density=2700.0, elements=4, rigid=False,
)  # fmt: skip


def shapes(frame: str) -> tuple[BeamMesh, Array]:
    """Return the elements of a blade and twelve of its shapes, of the size that they have at one energy."""
    nodes, reduction = {"root": 0.0, "end": LENGTH}, Reduction("craig_bampton", 12, frame=frame)
    mesh = BeamMesh(
        Beam("blade", (PIECE,), (), ("bend_y", "bend_z", "torsion"), 0.0, nodes, reduction), nodes
    )
    basis, omega = _modes(mesh, list(nodes))
    return mesh, basis / omega


def integrated(curvature, root_turn: Array, x: float, cuts: Array) -> tuple[Array, Array]:
    """Return place and rotation at ``x`` of a line with curvature(x) in its own axes, from a turned root.

    The curvature jumps at ``cuts``.
    """

    def rates(s, y):
        R = y[3:].reshape(3, 3)
        return np.concatenate([R[:, 0], (R @ skew(curvature(s))).ravel()])

    y = np.concatenate([np.zeros(3), Rotation.from_rotvec(root_turn).as_matrix().ravel()])
    ends = [cut for cut in cuts if cut < x] + [x]
    for start, end in pairwise(ends):
        within = end - 1e-12  # of this element, not the next
        y = solve_ivp(rates, (start, within), y, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    return y[:3], y[3:].reshape(3, 3)


def off(frame: str, size: float) -> float:
    """Return by how much the shapes miss the integrated line at ``AT``, place [m] and turn [rad]."""
    mesh, basis = shapes(frame)
    eta = size * np.random.default_rng(2).standard_normal(basis.shape[1])

    def curvature(s: float) -> Array:
        _, twist, d_z, d_y = mesh.deformation(np.array([s]))[0] @ basis @ eta
        return np.array([twist, -d_z, d_y])

    def end_beside(turn: Array) -> Array:
        return integrated(curvature, np.array([0.0, *turn]), LENGTH, mesh.nodes)[0][1:]

    turn = fsolve(end_beside, np.zeros(2), xtol=1e-12) if frame == "chord" else np.zeros(2)
    p, R = integrated(curvature, np.array([0.0, *turn]), AT, mesh.nodes)
    told = mesh.displacement(np.array([AT]))[0] @ basis @ eta
    line, twisted = (part[0] @ eta @ eta / 2 for part in SecondOrder(mesh, basis).at(np.array([AT])))
    off_line = p - [AT, 0.0, 0.0] - told[:3] - line
    off_turn = Rotation.from_matrix(R).as_rotvec() - told[3:] - twisted
    return float(np.linalg.norm([*off_line, *off_turn]))


@pytest.mark.parametrize("frame", ["clamped", pytest.param("chord", marks=pytest.mark.slow)])
def test_what_is_left_out_of_a_node_is_of_third_order(frame: str) -> None:
    """Bending both ways and twist at once; halving the coordinates leaves an eighth."""
    errors = [off(frame, size) for size in (0.8, 0.4, 0.2)]
    print(errors)
    ratios = np.array(errors[:-1]) / np.array(errors[1:])
    assert np.all((ratios > 6.5) & (ratios < 9.5))


ARM = """
format: flexarm/1
name: edge
source: made up for a test
gravity: [0 m/s^2, 0 m/s^2, -9.81 m/s^2]
bodies:
  blade:
    type: beam
    pieces:
      - length: 1 m
        section: {shape: rectangle, along_y: 1 mm, along_z: 40 mm}
        youngs_modulus: 70 GPa
        shear_modulus: 26 GPa
        density: 1 kg/m^3
        elements: 8
    deformation: [bend_y, torsion]
    point_masses: [{name: load, at: 1 m, mass: LOAD kg}]
    damping_ratio: 1 %
    nodes: {end: 1 m}
    reduction: {method: craig_bampton, modes: 14, frame: clamped}
joints:
  turn:
    parent: world
    child: blade.root
    axes: {rz: {actuated: true, rotor_inertia: 1 kg m^2, effort: 60 N m}}
sensors: {encoder: {kind: encoder, axis: turn.rz, sigma: 1 urad}}
tip: blade.end
served: {modes: 1, home: [0 deg], rate: 500 Hz}
"""


def stiffness(folder: Path, load: float) -> float:
    """Return the square of the first frequency [1/s^2] under a load [kg]; below 0 where it tips over."""
    (folder / "edge.yaml").write_text(ARM.replace("LOAD", f"{load:.9g}"), encoding="utf-8")
    try:
        return float(
            linearize(ReducedTree(load_config(folder / "edge.yaml"), use_compiler=False)).omega[0] ** 2
        )
    except PoseError as error:
        assert "no stable equilibrium" in str(error)
        return -1.0


def test_a_blade_on_edge_tips_over_at_the_load_of_the_books(tmp_path: Path) -> None:
    """[Timoshenko1961, 6.3]: ``4.013 sqrt(E I G J) / L^2`` at the end of a cantilever that does not sag."""
    assert stiffness(tmp_path, 1e-3) > 0.0
    piece = load_config(tmp_path / "edge.yaml").bodies["blade"].pieces[0]
    critical = 4.013 * np.sqrt(piece.E * piece.I_z * piece.G * piece.torsion_constant) / 9.81
    assert 0.0 < stiffness(tmp_path, 0.995 * critical) < 0.05 * stiffness(tmp_path, 0.5 * critical)
    assert stiffness(tmp_path, 1.005 * critical) < 0.0
