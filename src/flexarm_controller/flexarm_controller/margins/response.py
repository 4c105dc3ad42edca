"""The answer of a closed loop to what enters it, on the unit circle, from one eigenvalue decomposition.

    c (e^{i a} - A)^-1 b = sum_k (c v_k) (w_k b) / (e^{i a} - lambda_k)

The angles ``a`` (frequency times period) lie close together where a pole is close to the circle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.numeric.balance import balance

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
EVEN, SLOW = 600, 200  # angles evenly spaced, and logarithmically towards zero
SLOWEST = 1e-6  # rad per period
AROUND = 30  # angles on either side of a pole
REACH = 40.0  # of its distance from the circle
CLOSEST = 1e-7  # distance from the circle that is told from none


@dataclass(frozen=True)
class Modes:
    """Eigenvalues of ``z+ = A z`` with their vectors.

    Attributes:
        values: (n_z,).
        right: Columns, (n_z, n_z).
        left: Rows, the inverse of ``right``.
    """

    values: Complex
    right: Complex
    left: Complex

    def participation(self, k: int) -> Array:
        """Return how much every state takes part in eigenvalue k [PerezArriaga1982], unit-free, (n_z,)."""
        return np.asarray(abs(self.right[:, k] * self.left[k]))


def decompose(A: Array) -> Modes:
    """Return the eigenvalues of a system whose states may have any units.

    Raises:
        LinAlgError: It cannot be diagonalised.
    """
    balanced, scale = balance(A)
    values, vectors = np.linalg.eig(balanced)
    right, left = vectors * scale[:, None], np.linalg.inv(vectors) / scale
    return Modes(*(np.asarray(part, dtype=complex) for part in (values, right, left)))


def angles_of(values: Complex) -> Array:
    """Return angles from 0 to pi, both included, that show every resonance of these poles [rad], (k,)."""
    spread = np.sinh(np.linspace(-np.arcsinh(REACH), np.arcsinh(REACH), 2 * AROUND + 1))
    upper = values[values.imag >= 0.0]
    width = np.maximum(abs(1.0 - abs(upper)), CLOSEST)
    near = (np.angle(upper)[:, None] + width[:, None] * spread).ravel()
    everywhere = [np.linspace(0.0, np.pi, EVEN), np.geomspace(SLOWEST, np.pi, SLOW)]
    angles = np.concatenate([near, *everywhere])
    return np.unique(angles[(angles >= 0.0) & (angles <= np.pi)])


def respond(modes: Modes, out: Array, enter: Array, angles: Array) -> Complex:
    """Return output i to input i at every angle, (m, k).

    Args:
        modes: Of the loop.
        out: Output rows, (m, n_z).
        enter: Input columns, (n_z, m).
        angles: On the unit circle [rad], (k,).
    """
    residues = (out @ modes.right) * (modes.left @ enter).T  # (m, n_z)
    return np.asarray(residues @ _poles(modes, angles))


def respond_jointly(modes: Modes, out: Array, enter: Array, angles: Array) -> Complex:
    """Return every output to every input at every angle, (k, m, m); arguments as of ``respond``."""
    residues = (out @ modes.right)[:, None, :] * (modes.left @ enter).T[None]  # (m, m, n_z)
    return np.asarray(np.moveaxis(residues @ _poles(modes, angles), 2, 0))


def _poles(modes: Modes, angles: Array) -> Complex:
    return np.asarray(1.0 / (np.exp(1j * angles) - modes.values[:, None]))  # (n_z, k)
