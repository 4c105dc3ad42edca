"""The ``bodies`` part of a manipulator's YAML."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flexarm_model.manipulator.body_spec import (
    DEFORMATIONS,
    Beam,
    Body,
    PointMass,
    Reduction,
    RigidBody,
)
from flexarm_model.manipulator.description import WORLD, NodeRef
from flexarm_model.reading.config_damping import read_damping
from flexarm_model.reading.config_imported import read_imported, read_superelement
from flexarm_model.reading.config_pieces import read_pieces
from flexarm_model.settings.strict_yaml import Section

REDUCTIONS = ("craig_bampton", "guyan")
FRAMES = ("clamped", "chord")
INTERFACES = ("welded", "pinned")
TENSOR = "xx, yy, zz, xy, xz, yz"  # the order in which a file lists the moments of inertia
PRINTED = 1e-5  # of the largest principal moment: what six digits of another program leave undecided


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
    ixx, iyy, izz, ixy, ixz, iyz = section.quantities("inertia", ["inertia"] * 6, (0.0,) * 6, TENSOR)
    inertia = np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
    (low, middle, high), turn = np.linalg.eigh(inertia)
    if low < -PRINTED * high or low + middle < high * (1 - PRINTED):
        raise section.error(
            "inertia",
            section.take("inertia"),
            f"expected {TENSOR} of the tensor about the centre of mass (not the order of URDF: xx, xy, xz, "
            "yy, yz, zz): its principal moments must be positive, none above the sum of the others",
        )
    if low < 0:
        inertia = turn @ np.diag([0.0, max(middle, 0.0), high]) @ turn.T
    nodes = {"root": np.zeros(3)}
    outer = section.section("nodes", {})
    for node in outer.names(taken=("root",)):
        nodes[node] = outer.quantities(node, ["length"] * 3)
    return RigidBody(name, mass, section.quantities("com", ["length"] * 3, (0.0,) * 3), inertia, nodes)


def _read_beam(name: str, section: Section) -> Beam:
    deformation = _read_deformation(section)
    pieces = read_pieces(section, shear="shear" in deformation)
    length = sum(piece.length for piece in pieces)
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
        deformation=deformation,
        damping_ratio=damping.ratio,
        nodes=nodes,
        reduction=_read_reduction(section, nodes),
        damping_time=section.quantity("damping_time", "time", damping.time, at_least=0.0),
        rotary_inertia=section.flag("rotary_inertia", True),
        damping_rate=damping.rate,
    )


def _read_deformation(section: Section) -> tuple[str, ...]:
    """Return the ways in which a beam deforms; shear needs one in which it bends."""
    ways = section.choices("deformation", DEFORMATIONS, at_least=1)
    if "shear" in ways and not {"bend_y", "bend_z"} & set(ways):
        raise section.error("deformation", list(ways), "shear goes with bend_y, bend_z or both")
    return ways


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


_READERS: dict[str, Callable[[str, Section], Body]] = {
    "rigid": _read_rigid,
    "beam": _read_beam,
    "imported": read_imported,
    "superelement": read_superelement,
}
