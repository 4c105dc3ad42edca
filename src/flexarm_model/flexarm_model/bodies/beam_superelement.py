"""A beam's superelement: modes of its finite elements, volume integrals over its sections."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.beam import BeamMesh, section_inertia
from flexarm_model.bodies.beam_second_order import SecondOrder
from flexarm_model.bodies.reduction import count_modes_below, craig_bampton, guyan, mode_basis
from flexarm_model.bodies.rigid_pieces import tied_end
from flexarm_model.bodies.superelement import NodeShape, Superelement
from flexarm_model.manipulator.body_spec import Beam, Reduction

Array = NDArray[np.float64]


def reduce_beam(beam: Beam, interfaces: Collection[str], *, second_order: bool = True) -> Superelement:
    """Reduce a beam; see ``reduce_body``.

    Args:
        beam: The body.
        interfaces: Its nodes that joints use.
        second_order: Whether to add the second-order fields; linear models do without, and many modes must.

    Raises:
        ValueError: More modes are asked for than there are, or a displacement has no mass.
    """
    used = _used(beam, interfaces)
    mesh = BeamMesh(beam, used)
    basis, omega = _modes(mesh, used)
    at = mesh.stations()
    x = np.concatenate([at.x, [point.at for point in beam.point_masses]])
    rho = at.weight * at.values("density")
    inertia = [rho[k] * section_inertia(beam, piece) for k, piece in enumerate(at.pieces)]
    inertia += [np.full(3, point.inertia) for point in beam.point_masses]  # (k, 3), about x, y, z
    about = np.sum(inertia, axis=1)[:, None] / 2 - inertia  # int x^2, int y^2, int z^2
    centre = np.concatenate([rho * at.values("area"), [point.mass for point in beam.point_masses]])
    weight = {"centre": centre, **dict(zip("xyz", about.T, strict=True))}
    second = SecondOrder(mesh, basis)
    N = _fields(mesh, basis, x, second if second_order else None)
    s = np.einsum("k,kai->ai", weight["centre"], N["centre"])
    products = [
        np.einsum("k,kai,kbj->abij", weight[key], N[key], N[key], optimize=True)
        for key in N
        if weight[key].any()
    ]
    n_f = N["centre"].shape[1]
    P = np.sum(products, axis=0) if products else np.zeros((n_f, n_f, 3, 3))
    K = np.diag(omega**2)
    D = beam.damping_time * K
    nodes = {name: _node_shape(mesh, basis, second, station) for name, station in beam.nodes.items()}
    mass = float(weight["centre"].sum())
    return Superelement(beam.name, mass, s, P, omega, K, D, nodes, beam.damping_ratio, beam.damping_rate)


def count_modes(beam: Beam, interfaces: Collection[str]) -> int:
    """Return how many modes a beam can keep: the displacements of its elements that are free.

    Args:
        beam: The body.
        interfaces: Its nodes that joints use.
    """
    return int(_free(BeamMesh(beam, _used(beam, interfaces))).size)


def count_static(beam: Beam, interfaces: Collection[str]) -> int:
    """Return how many static shapes the nodes have that a beam's reduction is to keep.

    Args:
        beam: The body.
        interfaces: Its nodes that joints use.
    """
    mesh = BeamMesh(beam, used := _used(beam, interfaces))
    return int(np.isin(_free(mesh), _boundary(mesh, used)).sum())


def _used(beam: Beam, interfaces: Collection[str]) -> list[str]:
    return [name for name in beam.nodes if name in interfaces or name in beam.reduction.retain]


def _free(mesh: BeamMesh) -> NDArray[np.intp]:
    """Return the displacements that the floating frame leaves to the deformation."""
    return np.setdiff1d(mesh.active, _frame_constraints(mesh))


def _modes(mesh: BeamMesh, used: list[str]) -> tuple[Array, Array]:
    """Return the reduced basis over all nodal displacements (n_dof, n) and the frequencies (n,)."""
    reduction, T = mesh.beam.reduction, mesh.transformation
    M, K = (T.T @ matrix @ T for matrix in mesh.matrices())
    free = _free(mesh)
    inner = np.ix_(free, free)
    boundary = np.flatnonzero(np.isin(free, _boundary(mesh, used)))
    available = boundary.size if reduction.method == "guyan" else free.size
    if reduction.modes > available:
        name = mesh.beam.name
        raise ValueError(f"body '{name}': {reduction.modes} modes asked for, {available} available")
    try:
        basis = _basis(M[inner], K[inner], boundary, reduction)
        modes, omega = mode_basis(M[inner], K[inner], basis, reduction.modes or basis.shape[1])
    except np.linalg.LinAlgError:
        raise ValueError(_describe_massless(mesh.beam)) from None
    return T[:, free] @ modes, omega


def _basis(M: Array, K: Array, boundary: NDArray[np.intp], reduction: Reduction) -> Array:
    """Return the basis that the reduction asks for, over the free displacements, (n, n_b)."""
    if reduction.method == "guyan" and reduction.modes:
        return guyan(K, boundary)
    # without a static mode to keep the body follows its root
    n_modes = max(reduction.modes - boundary.size, 0)
    return craig_bampton(M, K, boundary, n_modes + count_modes_below(M, K, boundary, reduction.f_max))


def _describe_massless(beam: Beam) -> str:
    """Return what to say of a beam whose mass matrix is not positive definite."""
    empty = [f"pieces.{i}" for i, piece in enumerate(beam.pieces) if not piece.density and not piece.rigid]
    where = f"{', '.join(empty)} without density" if empty else "displacements without mass"
    return (
        f"body '{beam.name}': {where}: its modes need mass everywhere; give it density, or keep the static "
        "shapes of nodes with mass alone (method: guyan)"
    )


def _boundary(mesh: BeamMesh, used: list[str]) -> NDArray[np.intp]:
    """Return the independent displacements behind what the interfaces keep."""
    rows = [mesh.transformation[mesh.dof(name)[_kept(mesh.beam, name)]] for name in used]
    found = [np.flatnonzero(of_node.any(axis=0)) for of_node in rows]
    return np.unique(np.concatenate(found)) if found else np.zeros(0, dtype=np.intp)


def _kept(beam: Beam, node: str) -> list[int]:
    """Return which of the six displacements an interface keeps.

    A welded one keeps its position and rotation, a pinned one its position. The chord frame follows the
    hinges at its ends itself, and keeps none of the shapes that a bending moment makes there unless the
    node is retained.
    """
    reduction = beam.reduction
    if reduction.interface == "pinned":
        return [0, 1, 2]
    if reduction.frame == "chord" and node not in reduction.retain and tied_end(beam, node):
        return [0, 3]  # how far along and about the beam; the frame holds the rest
    return [0, 1, 2, 3, 4, 5]


def _frame_constraints(mesh: BeamMesh) -> NDArray[np.intp]:
    """Return the displacements that the floating frame takes away from the deformation."""
    root, end = mesh.dof("root"), np.arange(mesh.n_dof - 6, mesh.n_dof)
    return {"clamped": root, "chord": np.concatenate([root[:4], end[1:3]])}[mesh.beam.reduction.frame]


def _fields(mesh: BeamMesh, basis: Array, x: Array, of_second_order: SecondOrder | None) -> dict[str, Array]:
    """Return the fields N and their slopes over the section at ``x``, (k, n_f, 3) each."""
    u = mesh.displacement(x) @ basis  # (k, 6, n)
    ux, uy, uz, rx, ry, rz = (u[:, i] for i in range(6))
    zero, one, none = np.zeros_like(rx), np.ones(x.size), np.zeros(x.size)
    i, j = np.triu_indices(0 if of_second_order is None else basis.shape[1])  # the order of ``pairs``
    flat, second = np.zeros((2, x.size, i.size, 3))
    if of_second_order is not None:
        second[:] = of_second_order.at(x)[0][:, :, i, j].transpose(0, 2, 1)
    centre = np.stack([ux, uy, uz], axis=2)
    along_x = np.stack([zero, rz, -ry], axis=2)
    along_y, along_z = np.stack([-rz, zero, rx], axis=2), np.stack([ry, -rx, zero], axis=2)
    r = {"centre": (x, none, none), "x": (one, none, none), "y": (none, one, none), "z": (none, none, one)}
    first = {"centre": centre, "x": along_x, "y": along_y, "z": along_z}
    last = {"centre": second, "x": flat, "y": flat, "z": flat}
    return {
        key: np.concatenate([np.stack(r[key], axis=1)[:, None], first[key], last[key]], axis=1) for key in r
    }


def _node_shape(mesh: BeamMesh, basis: Array, second: SecondOrder, station: float) -> NodeShape:
    x = np.array([station])
    u = mesh.displacement(x)[0] @ basis
    d = mesh.deformation(x)[0] @ basis
    G, H = (part[0] for part in second.at(x))
    return NodeShape(np.array([station, 0.0, 0.0]), u[:3], u[3:], G, H, d[[0, 3, 2]])
