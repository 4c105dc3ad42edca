"""A superelement of other mass, stiffness and damping: what the same body is in other material.

With factors k on stiffness, m on mass and d on damping the shapes stay, and coordinates ``sqrt(m) eta`` keep
the modal mass of the modes. So a field of order e in the coordinates (0 position, 1 mode, 2 shortening) is
divided by ``m^(e/2)``, and::

    s_a   m / m^(e_a/2)               P_ab    m / m^((e_a + e_b)/2)
    K     k / m                       omega   sqrt(k / m)
    D     k d / m                     damping ratio and rate   d

Viscous damping D goes with the stiffness, as that of a beam does (``damping_time``).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from flexarm_model.bodies.superelement import NodeShape, Superelement


@dataclass(frozen=True)
class Scales:
    """Factors on a body's stiffness, mass and damping [1]; the mass must be positive."""

    stiffness: float = 1.0
    mass: float = 1.0
    damping: float = 1.0


def scale_superelement(body: Superelement, scales: Scales) -> Superelement:
    """Return the body with stiffness, mass and damping times their factors; factors of 1 change nothing."""
    root = np.sqrt(scales.mass)
    order = np.full(body.s.shape[0], 2)
    order[: body.n + 1] = 1
    order[0] = 0
    field = root**-order  # (n_f,)
    pliancy = scales.stiffness / scales.mass
    return replace(
        body,
        mass=body.mass * scales.mass,
        s=scales.mass * body.s * field[:, None],
        P=scales.mass * body.P * np.multiply.outer(field, field)[:, :, None, None],
        omega=body.omega * np.sqrt(pliancy),
        K=body.K * pliancy,
        D=body.D * pliancy * scales.damping,
        nodes={name: _scale_node(node, 1 / root) for name, node in body.nodes.items()},
        damping_ratio=body.damping_ratio * scales.damping,
        damping_rate=body.damping_rate * scales.damping,
    )


def _scale_node(node: NodeShape, per_mode: float) -> NodeShape:
    return replace(
        node,
        Phi=node.Phi * per_mode,
        Psi=node.Psi * per_mode,
        G=node.G * per_mode**2,
        H=node.H * per_mode**2,
        strain=node.strain * per_mode,
    )
