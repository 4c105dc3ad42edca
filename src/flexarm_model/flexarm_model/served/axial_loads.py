"""What axial loads of bodies without geometric stiffness would change of the modes.

That is every body from a file of finite elements, and one of SID data without second-order fields. At rest
wrenches ``w`` on its interfaces bend such a body. With shapes ``N`` of the interfaces and frequencies
``omega_b`` of its own modes they are the best fit of ``omega_b^2 eta = N' w``. Along the length ``L`` from
its root the force on an interface has the part ``P``, tension positive. A mode that moves the interface by
``u`` across that, at a slope ``s``, in the frame of the root, then stores half of::

    P int y'^2 dx = P / (30 L) (36 u^2 - 6 L u s + 4 L^2 s^2)

with the cubic y of a beam between both [Przemieniecki1968]. Over ``omega^2`` it is the share of the mode's
stiffness that is missing, to first order. A body's own weight counts as half of it on its end, which makes
its part of the share half too large; modes that move no interface show nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.superelement import Superelement
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]

PERCENT = 100.0
MATTERS = 0.02  # of a mode's stiffness: one per cent of its frequency


def describe_axial_loads(tree: ReducedTree, model: ReducedModel) -> tuple[str, ...]:
    """Return a sentence on the mode that such axial loads would change most, if noticeably.

    Args:
        tree: The arm.
        model: Served of it, at rest.
    """
    shares = axial_shares(tree, model)
    of_all = sum(shares.values(), np.zeros(model.n_eta))
    if abs(of_all).max(initial=0.0) <= MATTERS:
        return ()
    k = int(np.argmax(abs(of_all)))
    names = ", ".join(f"'{name}'" for name, share in shares.items() if abs(share[k]) > MATTERS / len(shares))
    return (
        f"bodies without geometric stiffness: what {names} bears at rest here would change the stiffness of "
        f"mode {k + 1} by about {PERCENT * of_all[k]:+.0f} %; describe slender bodies as beams",
    )


def axial_shares(tree: ReducedTree, model: ReducedModel) -> dict[str, Array]:
    """Return the share of every mode's stiffness that axial loads of such bodies would make, by body.

    It is 0 of a body that keeps too few modes to tell its loads: the static ones of its interfaces do.

    Args:
        tree: The arm.
        model: Served of it, at rest.

    Returns:
        (n_eta,) each [1], negative under compression.
    """
    config, shares = tree.config, {}
    refs = {ref for joint in (*config.joints, *config.closures) for ref in (joint.parent, joint.child)}
    for name, body in tree.bodies.items():
        if not _has_geometric_stiffness(body):
            nodes = sorted({ref.node for ref in refs if ref.body == name and ref.node != "root"})
            rows = list(tree.elastic_coordinates(name))
            phi = model.Phi[rows][:, len(model.theta_names) :]  # (n, n_eta)
            energy = np.zeros(model.n_eta)
            for node, force in zip(nodes, _forces(body, nodes, model.q0[rows]), strict=True):
                energy += _energy(body, node, force, phi)
            shares[name] = energy / model.omega**2
    return shares


def _has_geometric_stiffness(body: Superelement) -> bool:
    """Return whether loads along a body change its stiffness, or it has none that could change."""
    return not body.n or bool(body.pairs) or any(node.G.any() for node in body.nodes.values())


def _forces(body: Superelement, nodes: list[str], eta: Array) -> list[Array]:
    """Return the force that bends the body at each of its loaded nodes, body axes [N], (3,) each."""
    shapes = [np.vstack([body.nodes[node].Phi, body.nodes[node].Psi]) for node in nodes]
    if not shapes:
        return []
    A = np.vstack(shapes).T / body.omega[:, None]  # (n, 6 nodes), the root of the compliance
    size = np.linalg.norm(A, axis=0)
    size[size == 0.0] = 1.0
    wrench, _, rank, _ = np.linalg.lstsq(A / size, body.omega * eta, rcond=None)
    told = wrench / size if rank == size.size else np.zeros(size.size)
    return [force[:3] for force in told.reshape(-1, 6)]


def _energy(body: Superelement, node: str, force: Array, phi: Array) -> Array:
    """Return twice the energy of an axial load in mass-normalised modes [1/s^2], (n_eta,).

    Args:
        body: The body.
        node: Where the load is.
        force: It, body axes [N], (3,).
        phi: What the modes are in the body's coordinates, (n, n_eta).
    """
    shape = body.nodes[node]
    L = float(np.linalg.norm(shape.r))
    if not L > 0.0:
        return np.zeros(phi.shape[1])
    along = shape.r / L
    u = shape.Phi @ phi
    u = u - np.outer(along, along @ u)
    s = np.cross(shape.Psi @ phi, along, axisa=0, axisc=0)
    form = 36 * np.sum(u * u, axis=0) - 6 * L * np.sum(u * s, axis=0) + 4 * L**2 * np.sum(s * s, axis=0)
    return np.asarray(float(force @ along) / (30 * L) * form)
