"""A body in a floating frame: rigid or linear elastic, in one form.

A material point sits at ``c = N z`` in the body frame, with fields ``N = [r, Phi_i, g_ij]`` and
``z = [1; eta_i; eta_i eta_j (1/2 when i = j)]``: reference position, mode shapes, and the second-order
fields of a beam (``beam_second_order``): along it the shortening ``g_ij = -int phi_i' phi_j' dx`` (geometric
stiffening [Kane1987]), across it what twist makes of bending. Only two kinds of volume integral enter the
dynamics::

    s_a  = int N_a dm              P_ab = int N_a N_b^T dm

Standard input data [Wallrapp1994] names what they contain so, with ``ax(B)_k = e_kij B_ij``::

    mdCM   s_0, to first order s_i      Me_ij   tr P_ij
    J      tr(P_00) 1 - P_00            Gr_i    2 (tr(P_i0) 1 - P_i0)
    Ct_i   s_i                          Ge_ij   2 ax(P_ji)
    Cr_i   ax(P_0i)                     Oe_i    symmetric part of P_0i

Geometric stiffening, of ``s_ij`` and ``P_0,ij``, is in the first order of Ct, Cr, Gr, Oe (``sid_terms``).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class NodeShape:
    """How a node moves: ``p = r + Phi eta + 1/2 eta' G eta``, rotated by ``Psi eta + 1/2 eta' H eta``.

    Attributes:
        r: Reference position [m], (3,).
        Phi: Translation, (3, n).
        Psi: Rotation, (3, n).
        G: Second-order translation, (3, n, n).
        H: Second-order rotation, (3, n, n).
        strain: Strain at offset (y, z) is ``strain[0] - y strain[1] - z strain[2]``, (3, n); NaN if unknown.
    """

    r: Array
    Phi: Array
    Psi: Array
    G: Array
    H: Array
    strain: Array


@dataclass(frozen=True)
class Superelement:
    """A body reduced to ``n`` elastic coordinates; ``n = 0`` is a rigid one.

    Attributes:
        name: Name of the body.
        mass: Mass [kg].
        s: First moments of the fields, (n_f, 3); without second-order fields n_f is n + 1.
        P: Second moments of the fields, (n_f, n_f, 3, 3).
        omega: Frequencies of its own modes [rad/s], (n,).
        K: Stiffness, (n, n).
        D: Viscous damping, (n, n).
        nodes: By name.
        damping_ratio: Of every mode that strains this body alone [1], in addition.
        damping_rate: Damping over mass of every such mode [1/s], in addition.
    """

    name: str
    mass: float
    s: Array
    P: Array
    omega: Array
    K: Array
    D: Array
    nodes: dict[str, NodeShape]
    damping_ratio: float = 0.0
    damping_rate: float = 0.0

    @property
    def n(self) -> int:
        """Number of elastic coordinates."""
        return int(self.omega.size)

    @cached_property
    def turns(self) -> Array:
        """Rotation of all nodes below one another, (3 nodes, n): what ``Psi`` says of each."""
        return np.concatenate([np.zeros((0, self.n)), *(node.Psi for node in self.nodes.values())])

    @property
    def pairs(self) -> list[tuple[int, int]]:
        """Index pairs of the second-order fields; none when the body was given without them."""
        return pairs(self.n) if self.s.shape[0] > self.n + 1 else []

    @property
    def own_damping(self) -> Array:
        """Damping of the body alone, in its frame, (n, n)."""
        return np.asarray(self.D + np.diag(2 * self.damping_ratio * self.omega + self.damping_rate))

    @property
    def modal_mass(self) -> Array:
        """Mass matrix of the elastic coordinates, (n, n)."""
        return np.asarray(np.trace(self.P[1 : self.n + 1, 1 : self.n + 1], axis1=2, axis2=3))


def pairs(n: int) -> list[tuple[int, int]]:
    """Return the index pairs (i <= j) of the second-order fields, in the order of ``z``."""
    return [(i, j) for i in range(n) for j in range(i, n)]
