"""The ``bodies`` part of a manipulator's YAML."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TypeAlias

import numpy as np

from flexarm_model.bodies.beam import short_elements
from flexarm_model.manipulator.body_spec import (
    DEFORMATIONS,
    Beam,
    BeamPiece,
    Body,
    PointMass,
    Reduction,
    RigidBody,
)
from flexarm_model.manipulator.description import WORLD, NodeRef
from flexarm_model.reading.config_damping import read_damping
from flexarm_model.reading.config_imported import read_imported, read_superelement
from flexarm_model.settings.strict_yaml import Section

REDUCTIONS = ("craig_bampton", "guyan")
FRAMES = ("clamped", "chord")
INTERFACES = ("welded", "pinned")
PRINTED = 1e-5  # of the largest principal moment: what six digits of another program leave undecided
_Figures: TypeAlias = tuple[float, float, float, float, tuple[float, float]]  # the last is ``reach``
MOST_ELEMENTS = 200  # of a piece; the time that a body takes grows with their third power


def read_bodies(top: Section) -> dict[str, Body]:
    """Read every body of the file, by name.

    Raises:
        ConfigError: A value is wrong; see ``strict_yaml``.
    """
    bodies: dict[str, Body] = {}
    top.section("bodies").names(taken=(WORLD,))
    for name, section in top.sections("bodies"):
        kind = section.choice("type", tuple(_READERS))
        bodies[name] = _READERS[kind](name, section)
        section.done()
    return bodies


def read_node(section: Section, key: str, bodies: dict[str, Body]) -> NodeRef:
    """Return the node "body.node", or "world", that a key names.

    Raises:
        ConfigError: There is none; lists those there are.
    """
    text = section.text(key)
    body, _, node = text.partition(".")
    if body == WORLD and not node:
        return NodeRef(WORLD, "root")
    known = [WORLD] + [f"{name}.{node}" for name, item in bodies.items() for node in item.nodes]
    if f"{body}.{node}" not in known:
        raise section.error(key, text, f"no such node; known: {', '.join(known)}")
    return NodeRef(body, node)


def _read_rigid(name: str, section: Section) -> RigidBody:
    mass = section.quantity("mass", "mass", at_least=0.0)
    ixx, iyy, izz, ixy, ixz, iyz = section.quantities("inertia", ["inertia"] * 6, (0.0,) * 6)
    inertia = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
    (low, middle, high), turn = np.linalg.eigh(inertia)
    if low < -PRINTED * high or low + middle < high * (1 - PRINTED):
        raise section.error(
            "inertia",
            inertia.tolist(),
            "principal moments must be positive, none above the sum of the others",
        )
    if low < 0:
        inertia = turn @ np.diag([0.0, max(middle, 0.0), high]) @ turn.T
    nodes = {"root": np.zeros(3)}
    outer = section.section("nodes", {})
    for node in outer.names(taken=("root",)):
        nodes[node] = outer.quantities(node, ["length"] * 3)
    return RigidBody(name, mass, section.quantities("com", ["length"] * 3, (0.0,) * 3), inertia, nodes)


def _read_beam(name: str, section: Section) -> Beam:
    pieces = tuple(_read_piece(item) for item in section.items("pieces"))
    if not pieces:
        raise section.error("pieces", [], "expected at least one piece")
    length = sum(piece.length for piece in pieces)
    _refuse_short_elements(section, pieces)
    masses = []
    for item in section.items("point_masses", ()):
        masses.append(
            PointMass(
                item.text("name"),
                _read_station(item, "at", length),
                item.quantity("mass", "mass", above=0.0),
                item.quantity("inertia", "inertia", 0.0, at_least=0.0),
            )
        )
        item.done()
    nodes = {"root": 0.0}
    outer = section.section("nodes", {})
    for node in outer.names(taken=("root",)):
        nodes[node] = _read_station(outer, node, length)
    damping = read_damping(section, ("rayleigh", "damping_time"))
    if damping.time and section.has("damping_time"):
        raise section.error("damping_time", section.take("damping_time"), "is rayleigh.beta; give it once")
    return Beam(
        name,
        pieces,
        tuple(masses),
        deformation=section.choices("deformation", DEFORMATIONS, at_least=1),
        damping_ratio=damping.ratio,
        nodes=nodes,
        reduction=_read_reduction(section, nodes),
        damping_time=section.quantity("damping_time", "time", damping.time, at_least=0.0),
        rotary_inertia=section.flag("rotary_inertia", True),
        damping_rate=damping.rate,
    )


def _refuse_short_elements(section: Section, pieces: Sequence[BeamPiece]) -> None:
    for i, length, least in short_elements(pieces):
        allowed = (
            f"its elements are {length:.3g} m long, {least:.3g} m is the least (1/10000 of the beam), or "
            "rounding is all its stiffness: give the piece fewer, make it rigid, or part of its neighbour"
        )
        raise section.error(f"pieces.{i}.elements", pieces[i].elements, allowed)


def _read_reduction(section: Section, nodes: dict[str, float]) -> Reduction:
    inner = section.section("reduction")
    method, frame = inner.choice("method", REDUCTIONS), inner.choice("frame", FRAMES, "clamped")
    retain = inner.choices("retain", tuple(nodes), ())
    interface = inner.choice("interface", INTERFACES, "welded")
    f_max = inner.quantity("f_max", "frequency", above=0.0) if inner.has("f_max") else 0.0
    modes = inner.count("modes", 0, at_least=0 if f_max or method == "guyan" else 1)
    if f_max and (modes or method == "guyan"):
        raise inner.error("f_max", f_max, "expected alone, with craig_bampton: it says how many modes")
    reduction = Reduction(method, modes, frame, retain, interface, f_max)
    inner.done()
    return reduction


def _read_station(section: Section, key: str, length: float) -> float:
    at = section.quantity(key, "length", at_least=0.0)
    if at > length * (1 + 1e-12):
        raise section.error(key, section.take(key), f"lies beyond the end of the beam, {length:g} m")
    return at


def _read_piece(item: Section) -> BeamPiece:
    if item.flag("rigid"):
        return _read_rigid_piece(item)
    shape = item.section("section")
    area, I_y, I_z, torsion, reach = _SECTIONS[shape.choice("shape", tuple(_SECTIONS))](shape)
    shape.done()
    E = item.quantity("youngs_modulus", "pressure", above=0.0)
    piece = BeamPiece(
        length=item.quantity("length", "length", above=0.0),
        area=area,
        I_y=I_y,
        I_z=I_z,
        torsion_constant=torsion,
        E=E,
        G=item.quantity("shear_modulus", "pressure", E / 2.6, above=0.0),  # Poisson's ratio 0.3
        density=item.quantity("density", "density", at_least=0.0),
        elements=item.count("elements", at_most=MOST_ELEMENTS),
        axial_rigidity=item.quantity("axial_rigidity", "force", above=0.0)
        if item.has("axial_rigidity")
        else None,
        reach=reach,
    )
    item.done()
    return piece


def _read_rigid_piece(item: Section) -> BeamPiece:
    """Return a piece without mass that does not deform; what it weighs is a point mass."""
    length = item.quantity("length", "length", above=0.0)
    item.done()
    return BeamPiece(length, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, density=0.0, elements=1, rigid=True)


def _rectangle(shape: Section) -> _Figures:
    """Area, I_y, I_z, torsion constant and reach of a rectangle [Roark, table 10.7]."""
    y = shape.quantity("along_y", "length", above=0.0)
    z = shape.quantity("along_z", "length", above=0.0)
    a, b = max(y, z) / 2, min(y, z) / 2
    torsion = a * b**3 * (16 / 3 - 3.36 * b / a * (1 - b**4 / (12 * a**4)))
    return y * z, y * z**3 / 12, z * y**3 / 12, torsion, (y / 2, z / 2)


def _tube(shape: Section) -> _Figures:
    """Area, I_y, I_z, torsion constant and reach of a round tube or rod."""
    outer = shape.quantity("outer_diameter", "length", above=0.0)
    inner = shape.quantity("inner_diameter", "length", 0.0, at_least=0.0)
    if not inner < outer:
        raise shape.error("inner_diameter", inner, f"must be below the outer diameter, {outer:g} m")
    second = math.pi * (outer**4 - inner**4) / 64
    return math.pi * (outer**2 - inner**2) / 4, second, second, 2 * second, (outer / 2, outer / 2)


def _box(shape: Section) -> _Figures:
    """Area, I_y, I_z, torsion constant 4 A_m^2 t / s (Bredt) and reach of a box [Roark, table 10.7]."""
    y = shape.quantity("along_y", "length", above=0.0)
    z = shape.quantity("along_z", "length", above=0.0)
    wall = shape.quantity("wall", "length", above=0.0)
    if not 2 * wall < min(y, z):
        raise shape.error("wall", wall, f"must be below half the narrower side, {min(y, z) / 2:g} m")
    inner_y, inner_z, middle_y, middle_z = y - 2 * wall, z - 2 * wall, y - wall, z - wall
    torsion = 2 * wall * (middle_y * middle_z) ** 2 / (middle_y + middle_z)
    I_y, I_z = (y * z**3 - inner_y * inner_z**3) / 12, (z * y**3 - inner_z * inner_y**3) / 12
    return y * z - inner_y * inner_z, I_y, I_z, torsion, (y / 2, z / 2)


def _given(shape: Section) -> _Figures:
    """Section properties as numbers."""
    moment = "second moment of area"
    return (
        shape.quantity("area", "area", above=0.0),
        shape.quantity("I_y", moment, above=0.0),
        shape.quantity("I_z", moment, above=0.0),
        shape.quantity("torsion_constant", moment, above=0.0),
        (math.inf, math.inf),
    )


_READERS: dict[str, Callable[[str, Section], Body]] = {
    "rigid": _read_rigid,
    "beam": _read_beam,
    "imported": read_imported,
    "superelement": read_superelement,
}
_SECTIONS: dict[str, Callable[[Section], _Figures]] = {
    "rectangle": _rectangle,
    "tube": _tube,
    "given": _given,
    "box": _box,
}
