"""From the reduced tree at a pose to the served form.

The actuated axes are held at the pose and the rest settles (Newton), loops closed. Motions within the
loops are ``q' = N u``, the actuated axes first; with everything projected on them the rest splits into
what follows the axes statically and the modes with the axes locked::

    q = q0 + N [1 0; Psi Phi] (xi - [pose; 0])     Psi = -K_zz^-1 K_zt     K_zz Phi = M_zz Phi W^2

Where a loop carries load, its forces turn with it: K includes ``d(G' lambda)/dq``.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.reduction import mode_basis
from flexarm_model.served.bent_bodies import turns_at_rest
from flexarm_model.served.loop_closing import CLOSED, close_at
from flexarm_model.served.reduced_model import Outputs, ReducedModel
from flexarm_model.settings.units import axis_dimension, si_unit
from flexarm_model.tree.massless import describe_massless, has_mass, name_moved
from flexarm_model.tree.reduced_tree import ReducedTree
from flexarm_model.tree.rest import Settled, come_to_rest, is_stable
from flexarm_model.tree.sensors import output_names, output_units

Array = NDArray[np.float64]

MAX_ITERATIONS = 20
FREE = 1e-7  # of the fastest frequency: below it a frequency is rounding
BENT = 0.3  # rad: a beam under a load at its end sags there by 4 % more than Euler's elastica does
EQUILIBRIUM_TOLERANCE = 1e-10  # unbalanced generalised force, relative to the largest one


class PoseError(ValueError):
    """No model can be made at this pose; the message says why."""


def linearize(tree: ReducedTree, pose: Array | None = None, modes: int | None = None) -> ReducedModel:
    """Return the reduced model about a pose.

    Args:
        tree: The dynamics; several threads may share it.
        pose: Actuated axes [rad or m], (n_theta,); None is the home pose.
        modes: Number of modes; None is what the description asks for.

    Raises:
        PoseError: Wrong length, not finite, outside the axes' limits, also those of passive axes, no stable
            equilibrium or one with a body bent too far, more modes asked for than exist or no whole
            number of them, or a coordinate without mass.
    """
    config = tree.config
    pose = check_pose(tree, config.home if pose is None else pose)
    q0, force, (M, D, K, f0) = _settle(tree, pose)
    _refuse_beyond_stops(tree, pose, q0)
    _refuse_bent(tree, pose, q0)
    K += constraint_stiffness(tree, q0, force)
    n, n_eta = len(tree.actuated), config.modes if modes is None else modes
    N = tree.motions_within(q0)
    try:
        T, omega = _shapes(N, (M + M.T) / 2, K, n, n_eta, tree.coordinates)
    except np.linalg.LinAlgError:
        raise PoseError(f"pose {pose.tolist()}: {describe_massless(M, N[:, n:], tree.coordinates)}") from None
    except PoseError as error:
        raise PoseError(f"pose {pose.tolist()}: {error}") from None
    if not has_mass(N.T @ M @ N):
        raise PoseError(f"pose {pose.tolist()}: {describe_massless(M, N, tree.coordinates)}")
    M_r, D_r, K_r = (T.T @ matrix @ T for matrix in (M, D, K))
    M_r[n:, n:], K_r[n:, n:] = np.eye(n_eta), np.diag(omega**2)  # what they are but for round-off
    K_r[:n, n:] = K_r[n:, :n] = 0.0
    y0, *rows = (np.array(part) for part in tree.functions["output_rows"](q0))
    outputs = Outputs(output_names(config), output_units(config), y0, *(row @ T for row in rows))
    zeta = np.diag(D_r)[n:] / (2 * omega)
    return ReducedModel(
        manipulator=config.name,
        config_id=config.config_id,
        theta_names=tuple(tree.axis_names[i] for i in tree.actuated),
        pose=pose,
        M=(M_r + M_r.T) / 2,
        D=D_r,
        K=(K_r + K_r.T) / 2,
        B=np.eye(n + n_eta)[:, :n].copy(),
        f0=T.T @ f0,
        omega=omega,
        zeta=zeta,
        outputs=outputs,
        q0=q0,
        Phi=T,
    )


def _shapes(N: Array, M: Array, K: Array, n: int, n_eta: int, names: Sequence[str]) -> tuple[Array, Array]:
    """Return static deflections and modes as columns, and the modes' frequencies [rad/s].

    Args:
        N: Motions that the loops allow; the first ``n`` columns move the actuated axes, (n_q, n_z).
        M: Mass, (n_q, n_q).
        K: Stiffness, (n_q, n_q).
        n: Number of actuated axes.
        n_eta: Number of modes.
        names: Of the coordinates, (n_q,).

    Raises:
        PoseError: So many modes do not exist, their number is not whole, or one has no stiffness.
    """
    N_t, Z = N[:, :n], N[:, n:]
    if not isinstance(n_eta, int | np.integer):
        raise PoseError(f"{n_eta} modes asked for; expected a whole number")
    if not 0 <= n_eta <= Z.shape[1]:
        exist = f"{n_eta} modes asked for, {Z.shape[1]} exist"
        raise PoseError(f"{exist}; serve fewer (served.modes) or keep more in the bodies (reduction.modes)")
    T, omega = N[:, : n + n_eta].copy(), np.zeros(0)
    if Z.shape[1]:
        Phi, omega = mode_basis(M, (K + K.T) / 2, Z, Z.shape[1])
        if omega[0] <= FREE * omega[-1]:
            flat = f"a mode has no stiffness; it moves {name_moved(Phi[:, 0], names)}"
            held = "an axis is held by a motor (actuated: true), a spring, or gravity"
            raise PoseError(f"no stable equilibrium: {flat}; {held}")
        T[:, :n] = N_t - Z @ np.linalg.solve(Z.T @ K @ Z, Z.T @ K @ N_t)
        T[:, n:], omega = Phi[:, :n_eta], omega[:n_eta]
    return T, omega


def check_pose(tree: ReducedTree, pose: Array) -> Array:
    """Return the pose as an array, (n_theta,) [rad or m].

    Raises:
        PoseError: Wrong length, not finite, or outside the limits of an axis.
    """
    pose = np.array(pose, dtype=float)
    axes = {tree.axis_names[i]: tree.axes[i] for i in tree.actuated}
    if pose.shape != (len(axes),):
        is_shape = pose.size == len(axes)  # a number for a list of one, a column for a row
        given, wanted = (pose.shape, (len(axes),)) if is_shape else (f"{pose.size} values", len(axes))
        raise PoseError(
            f"pose has {'shape ' if is_shape else ''}{given}; expected {wanted}: {', '.join(axes)}"
        )
    for (name, axis), value in zip(axes.items(), pose, strict=True):
        if not (np.isfinite(value) and axis.lower <= value <= axis.upper):
            unit = si_unit(axis_dimension(axis.name, "position"))
            limits = f"[{axis.lower:.6g}, {axis.upper:.6g}] {unit}"
            raise PoseError(f"pose: {name} = {value:.6g} {unit} is not finite or outside {limits}")
    return pose


def _refuse_beyond_stops(tree: ReducedTree, pose: Array, q: Array) -> None:
    """Raise PoseError where passive axes rest at q (n_q,) outside their limits; whole turns are free."""
    for i in sorted(set(range(len(tree.axes))) - set(tree.actuated)):
        axis, at = tree.axes[i], float(q[i])
        if axis.name.startswith("r") and np.isfinite(middle := (axis.lower + axis.upper) / 2):
            at += 2 * np.pi * round((middle - at) / (2 * np.pi))
        if not axis.lower - CLOSED <= at <= axis.upper + CLOSED:
            unit = si_unit(axis_dimension(axis.name, "position"))
            limits = f"[{axis.lower:.6g}, {axis.upper:.6g}] {unit}"
            passive = f"needs the passive {tree.axis_names[i]} at {at:.6g}, outside {limits}"
            raise PoseError(f"pose {np.round(pose, 6).tolist()}: {passive}")


def _refuse_bent(tree: ReducedTree, pose: Array, q: Array) -> None:
    """Raise PoseError where a body rests at q (n_q,) so bent that its shapes, of first order, do not hold."""
    for name, turn in turns_at_rest(tree, q).items():
        if turn > BENT:
            where = f"pose {np.round(pose, 6).tolist()}: '{name}' rests bent"
            raise PoseError(
                f"{where}, a node turned by {turn:.3g} rad against its own frame: its shapes hold to {BENT:g}"
                " rad; expected a stiffer body, a smaller load, or several bodies welded end to end"
            )


def constraint_stiffness(tree: ReducedTree, q: Array, force: Array) -> Array:
    """Return the stiffness that the forces (n_c,) in the loops add as they turn, (n_q, n_q)."""
    if not tree.n_c:
        return np.zeros((tree.n_q, tree.n_q))
    return np.array(tree.functions["constraint_stiffness"](q, force))


def find_equilibrium(tree: ReducedTree, pose: Array) -> tuple[Array, Array]:
    """Return coordinates (n_q,) and forces in the loops (n_c,) at rest with the actuated axes at ``pose``.

    Raises:
        PoseError: Newton's iteration does not settle.
        ClosureError: The loops do not close at this pose.
    """
    return _settle(tree, pose)[:2]


def _settle(tree: ReducedTree, pose: Array) -> Settled:
    """Return coordinates, forces in the loops, and mass, damping, stiffness and forces at rest."""
    start, e = close_at(tree, pose), np.setdiff1d(np.arange(tree.n_q), tree.actuated)
    found, unbalanced = _balance(tree, start.copy(), e)
    if not tree.n_c and (found is None or not is_stable(found[2][2], e)):
        below = come_to_rest(tree.linearisation, start, e)
        found = found if below is None else _balance(tree, below, e)[0]
    if found is None:
        raise PoseError(f"no stable equilibrium at pose {pose.tolist()}: unbalanced force {unbalanced:.3g}")
    return found


def _balance(tree: ReducedTree, q: Array, e: NDArray[np.intp]) -> tuple[Settled | None, float]:
    """Return where forces balance by Newton's iteration from q, or None, and what was left [N or N m]."""
    force = np.zeros(tree.n_c)
    for _ in range(MAX_ITERATIONS):
        parts = tree.linearisation(q)
        (_, _, K, f), (c, G) = parts, tree.constraints(q)
        unbalanced = f[e] + G[:, e].T @ force
        near = EQUILIBRIUM_TOLERANCE * max(1.0, abs(f).max(initial=0.0))
        if abs(unbalanced).max(initial=0.0) <= near and abs(c).max(initial=0.0) <= CLOSED:
            return (q, force, parts), 0.0
        K_e = (K + constraint_stiffness(tree, q, force))[np.ix_(e, e)]
        system = np.block([[K_e, G[:, e].T], [G[:, e], np.zeros((tree.n_c, tree.n_c))]])
        try:
            step = np.linalg.solve(system, -np.concatenate([unbalanced, c]))
        except np.linalg.LinAlgError:
            break
        q[e] += step[: e.size]
        force += step[e.size :]
    return None, float(abs(unbalanced).max())
