"""Cut a beam into rigid segments with springs at the centres of equal lengths.

Every flexible stretch of the beam has n springs. The first segment reaches from the root to the first
spring, the last from the last spring to the end: without rigid pieces n + 1 segments of length h/2, h,
..., h, h/2. A rigid piece belongs to the segment that it lies on.

A segment is turned as the beam is at its middle alone, and wrong by the curvature times the distance
elsewhere. What bears moments stands there, as at the ends: a stretch is cut where a joint or a mass with an
inertia of its own stands, each part of length l has the next whole number of springs from n l / L up.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.beam import rigidities, section_inertia, shear_rigidities
from flexarm_model.bodies.rigid_pieces import stretches
from flexarm_model.bodies.short_elements import SHORTEST
from flexarm_model.manipulator.body_spec import Beam, BeamPiece

Array = NDArray[np.float64]

_AXIS_OF = {
    "bend_y": "rz", "bend_z": "ry", "torsion": "rx", "stretch": "tx", "shear_y": "ty", "shear_z": "tz",
}  # fmt: skip
_WHOLE = 1e-9  # of a number of springs: rounding


@dataclass(frozen=True)
class Segment:
    """A rigid piece of the beam, in a frame at its own spring (at the root for the first).

    Attributes:
        index: 0 for the piece at the root.
        spring_at: Distance of its frame from the root [m].
        length: Length of beam that the spring stands for [m].
        springs: (deformation, axis, stiffness) of the spring that carries it; none at the root.
        to_next: Distance from this frame to the next spring [m].
        mass: Mass [kg].
        com: Centre of mass [m], (3,).
        inertia: About the centre of mass [kg m^2], (3, 3).
        nodes: Beam nodes that lie on it.
    """

    index: int
    spring_at: float
    length: float
    springs: tuple[tuple[str, str, float], ...]
    to_next: float
    mass: float
    com: Array
    inertia: Array
    nodes: tuple[str, ...]


def cut_beam(beam: Beam, n: int, joints: Iterable[float] = ()) -> list[Segment]:
    """Return the segments of a beam with n springs or more per flexible stretch, from the root outwards.

    Args:
        beam: The beam.
        n: Springs of a stretch without joints within.
        joints: Where these stand, distances from the root [m].

    Raises:
        ValueError: n is no whole number of 1 or more.
    """
    if not isinstance(n, int | np.integer) or n < 1:
        raise ValueError(f"n_segments is {n}; expected a whole number of springs per beam, 1 or more")
    springs = _places(beam, n, {*joints, *(point.at for point in beam.point_masses if point.inertia)})
    frames = [(0.0, springs[0][1]), *springs]
    ends = [*(at for at, _ in springs), beam.length]
    segments = []
    for index, ((frame, h), end) in enumerate(zip(frames, ends, strict=True)):
        is_last = index == len(springs)
        mass, com, inertia = _inertia(beam, frame, end, is_last=is_last)
        inside = tuple(name for name, x in beam.nodes.items() if frame <= x < end or (is_last and x >= frame))
        stiffness = _springs(beam, frame - h / 2, frame + h / 2) if index else ()
        offset = np.array([com - frame, 0.0, 0.0])
        segments.append(Segment(index, frame, h, stiffness, end - frame, mass, offset, inertia, inside))
    return segments


def _places(beam: Beam, n: int, cuts: Iterable[float]) -> list[tuple[float, float]]:
    """Return where springs stand, and what length of beam each stands for [m], from the root outwards.

    A cut closer to the end of a stretch, or to another cut, than the shortest element is long is none.
    """
    springs: list[tuple[float, float]] = []
    least = SHORTEST * beam.length
    for start, end in stretches(beam, rigid=False):
        ends = [start]
        for cut in sorted(cuts):
            if ends[-1] + least <= cut <= end - least:
                ends.append(cut)
        ends.append(end)
        for a, b in pairwise(ends):
            count = int(np.ceil(n * (b - a) / (end - start) - _WHOLE))
            springs += [(a + (k + 0.5) * (b - a) / count, (b - a) / count) for k in range(count)]
    return springs


def _springs(beam: Beam, start: float, end: float) -> tuple[tuple[str, str, float], ...]:
    """Return the springs of the length [start, end]: its pieces' compliances add up."""
    compliance = dict.fromkeys(_ways(beam), 0.0)
    for piece, a, b in _overlaps(beam, start, end):
        rigidity = dict(zip(("stretch", "torsion", "bend_z", "bend_y"), rigidities(piece), strict=True))
        if "shear" in beam.deformation:
            rigidity |= zip(("shear_y", "shear_z"), shear_rigidities(piece), strict=True)
        for kind in compliance:
            compliance[kind] += (b - a) / rigidity[kind]
    return tuple((kind, _AXIS_OF[kind], 1 / value) for kind, value in compliance.items())


def _ways(beam: Beam) -> list[str]:
    """Return the ways in which a segment's springs give: shear along y and z wherever the beam bends so."""
    ways = [way for way in beam.deformation if way != "shear"]
    if "shear" in beam.deformation:
        ways += [f"shear_{way[-1]}" for way in ways if way.startswith("bend")]
    return ways


def _inertia(beam: Beam, start: float, end: float, *, is_last: bool) -> tuple[float, float, Array]:
    """Return mass, centre of mass from the root, and inertia about it."""
    parts = [
        (p.density * p.area * (b - a), (a + b) / 2, (b - a), p) for p, a, b in _overlaps(beam, start, end)
    ]
    points = [m for m in beam.point_masses if start <= m.at < end or (is_last and m.at >= start)]
    mass = sum(part[0] for part in parts) + sum(point.mass for point in points)
    moment = sum(m * x for m, x, _, _ in parts) + sum(p.mass * p.at for p in points)
    com = moment / mass if mass else (start + end) / 2  # a piece may weigh nothing
    J = np.zeros(3)
    for m, x, length, piece in parts:
        section = m / piece.area * section_inertia(beam, piece)
        J += section + (m * length**2 / 12 + m * (x - com) ** 2) * np.array([0.0, 1.0, 1.0])
    for point in points:
        J += point.inertia + point.mass * (point.at - com) ** 2 * np.array([0.0, 1.0, 1.0])
    return mass, com, np.diag(J)


def _overlaps(beam: Beam, start: float, end: float) -> list[tuple[BeamPiece, float, float]]:
    """Return the pieces of beam within [start, end] as (piece, from, to)."""
    ends = np.cumsum([piece.length for piece in beam.pieces])
    found = []
    for piece, stop in zip(beam.pieces, ends, strict=True):
        a, b = max(start, stop - piece.length), min(end, float(stop))
        if b - a > 1e-12:
            found.append((piece, a, b))
    return found
