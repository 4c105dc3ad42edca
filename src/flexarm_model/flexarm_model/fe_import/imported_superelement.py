"""An imported body's superelement: first-order shapes in the frame of its interface node "root".

Without second-order shapes a fast turn softens the body and never stiffens it, and an axial load does neither
(no geometric stiffness). That is right for compact castings and wrong for slender blades, which are better
described as beams.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.reduction import mode_basis
from flexarm_model.bodies.superelement import NodeShape, Superelement
from flexarm_model.fe_import.checks import refuse_unsound
from flexarm_model.fe_import.fe_model import FeModel, load_model
from flexarm_model.fe_import.feeding_damping import refuse_feeding
from flexarm_model.fe_import.interfaces import Constraint, Interface, constrain, make_interface
from flexarm_model.fe_import.loose_nodes import empty_rows, loose, refuse_loose
from flexarm_model.fe_import.massless_combination import massless_combination
from flexarm_model.fe_import.rigid_mass import rigid_mass
from flexarm_model.fe_import.rigid_motions import refuse_resisted
from flexarm_model.fe_import.sparse_reduction import reduction_basis
from flexarm_model.fe_import.volume_integrals import volume_integrals
from flexarm_model.manipulator.imported_body import ImportedBody, ImportedReduction

Array = NDArray[np.float64]
FEWER = ", mesh finer, or keep fewer modes (reduction: a lower f_max, modes, or method: guyan)"
DIRECTIONS = ("x", "y", "z", "rotation about x", "rotation about y", "rotation about z")


def reduce_imported(body: ImportedBody, interfaces: Collection[str]) -> Superelement:
    """Reduce an imported body; see ``reduce_body``.

    Raises:
        ValueError: A file is wrong, the matrices are no free body's, or the reduction cannot be made.
    """
    model = load_model(body)
    refuse_unsound(model)
    used = {"root", *interfaces, *body.reduction.retain}
    nodes = {name: make_interface(model, name, item, body.nodes[name]) for name, item in body.sets.items()}
    held = [item for name, item in nodes.items() if item.is_rigid or name in used]
    constraint = constrain(model, held)
    try:
        refuse_loose(model, loose(model, [item.dof for item in held if item.is_rigid]))
        modes, omega = _modes(model, constraint, used - {"root"}, body.reduction)
        refuse_resisted(model, modes, omega)
    except ValueError as error:
        raise ValueError(f"body '{body.name}': {error}") from None
    s, P = volume_integrals(model, modes)
    K = np.diag(omega**2)
    D = body.damping_time * K if model.D is None else modes.T @ (model.D @ modes)
    D = (D + D.T) / 2  # what rounding leaves
    refuse_feeding(body.name, D)
    ratio, rate = (body.damping_ratio, body.damping_rate) if model.D is None else (0.0, 0.0)
    shapes = {name: _node_shape(item, body.nodes[name], modes) for name, item in nodes.items()}
    mass = rigid_mass(model).mass
    return Superelement(body.name, mass, s, P, omega, K, D, shapes, ratio, rate)


def _modes(
    model: FeModel, constraint: Constraint, used: Collection[str], reduction: ImportedReduction
) -> tuple[Array, Array]:
    """Return the body's own modes over all displacements (n_dof, n) and their frequencies (n,)."""
    T, columns = constraint.T, constraint.columns
    free = np.setdiff1d(np.arange(T.shape[1]), columns["root"])
    T_free = T[:, free]
    M, K = T_free.T @ model.M @ T_free, T_free.T @ model.K @ T_free
    refuse_loose(model, np.unique(T_free[:, empty_rows(K)].tocoo().row))
    kept = np.concatenate([np.zeros(0, dtype=np.intp), *(columns[name] for name in columns if name in used)])
    basis = reduction_basis(M, K, np.searchsorted(free, kept), reduction)
    n_modes = reduction.modes or basis.shape[1]
    _refuse_too_many(n_modes, basis.shape[1])
    _refuse_massless(basis.T @ (M @ basis), [name for name in columns if name in used])
    modes, omega = mode_basis(M, K, basis, min(n_modes + reduction.spare, basis.shape[1]))
    return np.asarray(T_free @ modes), omega


def _refuse_too_many(n_modes: int, available: int) -> None:
    if not available:
        raise ValueError(
            "reduction: no fixed-interface mode lies below f_max, and no interface is kept; expected a mode: "
            "a higher f_max, or modes"
        )
    if n_modes > available:
        raise ValueError(
            f"{n_modes} modes asked for, {available} available; expected reduction.modes from 1 to "
            f"{available}"
        )


def _refuse_massless(M: Array, kept: Sequence[str]) -> None:
    """Refuse a reduced mass (n, n) of which a displacement is none; the first ones are those of ``kept``.

    It would be a mode of infinite frequency, and rounding would take the others with it. Where static modes
    alone move no mass, no choice of further modes helps.
    """
    names = [f"{direction} of interface '{name}'" for name in kept for direction in DIRECTIONS]
    n_static = len(names)
    for size, advice in ((n_static, ""), (M.shape[0], FEWER)):
        amount = abs(massless_combination(M[:size, :size])) if size else np.zeros(0)
        if amount.size:
            where = names[int(np.argmax(amount[:n_static]))] if names else "a displacement"
            missing = "rotary inertia" if "rotation" in where else "mass"
            raise ValueError(
                f"{where} moves no mass of its own: give the mass matrix {missing} there{advice}"
            )


def _node_shape(item: Interface, at: Array, modes: Array) -> NodeShape:
    u = item.A @ modes[item.dof]  # (6, n)
    n = modes.shape[1]
    none = np.zeros((3, n, n))
    return NodeShape(at, u[:3], u[3:], none, none, np.full((3, n), np.nan))
