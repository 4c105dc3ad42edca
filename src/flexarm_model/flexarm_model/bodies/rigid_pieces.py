"""Rigid pieces of a beam: the mesh nodes of each move as one body.

Every node of a rigid stretch follows one of them, its master at x_m::

    u = u_m + r_m x (x - x_m) e_x        r = r_m

so the nodal displacements are ``T`` times those that are left, exactly and without a stiff modulus.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_model.manipulator.body_spec import Beam

Array = NDArray[np.float64]


def stretches(beam: Beam, *, rigid: bool) -> list[tuple[float, float]]:
    """Return where adjoining rigid (or flexible) pieces lie as (from, to) [m], from the root outwards."""
    found: list[tuple[float, float]] = []
    start = 0.0
    for piece in beam.pieces:
        end = start + piece.length
        if piece.rigid == rigid:
            if found and found[-1][1] == start:
                found[-1] = (found[-1][0], end)
            else:
                found.append((start, end))
        start = end
    return found


def tied_end(beam: Beam, node: str) -> str | None:
    """Return which end of a beam a node is tied to without anything that bends: "root", "end" or None."""
    x = beam.nodes[node]
    for start, stop in ((0.0, 0.0), (beam.length, beam.length), *stretches(beam, rigid=True)):
        if start <= x <= stop and (start == 0.0 or stop >= beam.length):
            return "root" if start == 0.0 else "end"
    return None


def rigid_transformation(beam: Beam, nodes: Array, interfaces: Sequence[float] = ()) -> Array:
    """Return all nodal displacements over the independent ones, (n_dof, n_dof); other columns are zero.

    The root or the far end is the master of its stretch, else its first interface, else its first node.

    Args:
        beam: The beam.
        nodes: Distance of the mesh nodes from the root [m], (n_nodes,).
        interfaces: Distance of the interfaces [m].

    Raises:
        ValueError: The whole beam is rigid.
    """
    if all(piece.rigid for piece in beam.pieces):
        raise ValueError(f"body '{beam.name}': no piece of the beam is flexible; describe it as a rigid body")
    T = np.eye(6 * nodes.size)
    wanted = [0.0, beam.length, *interfaces]
    for start, end in stretches(beam, rigid=True):
        members = np.flatnonzero((nodes > start - _TOUCHING) & (nodes < end + _TOUCHING))
        at = next((x for x in wanted if start - _TOUCHING < x < end + _TOUCHING), start)
        master = members[np.argmin(abs(nodes[members] - at))]
        for member in members[members != master]:
            T[6 * member : 6 * member + 6] = 0.0
            T[6 * member : 6 * member + 6, 6 * master : 6 * master + 6] = _follow(
                nodes[member] - nodes[master]
            )
    return T


_TOUCHING = 1e-8  # m: the mesh rounds its nodes to 1e-9


def _follow(distance: float) -> Array:
    """Return the displacements of a point ``distance`` further along x, over the master's, (6, 6)."""
    T = np.eye(6)
    T[1, 5], T[2, 4] = distance, -distance
    return T
