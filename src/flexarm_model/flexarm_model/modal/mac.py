"""Modal assurance criterion and what it cannot say alone: signs and double modes.

    MAC(a, b) = |a^H W b|^2 / ((a^H W a) (b^H W b))        [Allemang1982]

0 is orthogonal, 1 the same shape up to a factor. W = 1 compares sensor readings, W = M compares modes
of one model. Within a double mode any rotation is a mode too, so pairs are aligned by a rotation
(Procrustes), single modes by their sign.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Shapes = NDArray[Any]  # real or complex, a column per mode


def mac(a: Shapes, b: Shapes, weight: Array | None = None) -> Array:
    """Return the MAC of all pairs, in [0, 1], (r_a, r_b).

    Args:
        a: Shapes, (n, r_a).
        b: Shapes, (n, r_b).
        weight: Symmetric positive definite, (n, n); None is the identity.

    Raises:
        ValueError: Lengths differ, or a shape is zero or not finite.
    """
    a, b = _unit(a, weight), _unit(b, weight)
    if a.shape[0] != b.shape[0]:
        raise ValueError(f"shapes of {a.shape[0]} and {b.shape[0]} values cannot be compared")
    return np.asarray(np.minimum(abs(a.conj().T @ b) ** 2, 1.0))


def auto_mac(a: Shapes, weight: Array | None = None) -> Array:
    """Return the MAC of shapes among themselves, (r, r); large off the diagonal: too few sensors."""
    return mac(a, a, weight)


def align_signs(shapes: Shapes, reference: Shapes, weight: Array | None = None) -> Shapes:
    """Return shapes turned (real: by sign, complex: by phase) towards the reference, both (n, r)."""
    product = np.sum(reference.conj() * _weighted(shapes, weight), axis=0)  # (r,)
    size = abs(product)
    turn = np.where(size > 0.0, product.conj() / np.where(size > 0.0, size, 1.0), 1.0)
    return np.asarray(shapes * turn)


def align_rotation(shapes: Shapes, reference: Shapes, weight: Array | None = None) -> Shapes:
    """Return the orthonormal mixture of the columns of a multiple mode nearest to the reference, (n, r)."""
    left, _, right = np.linalg.svd(shapes.conj().T @ _weighted(reference, weight))
    return np.asarray(shapes @ (left @ right))


def _weighted(shapes: Shapes, weight: Array | None) -> Shapes:
    return shapes if weight is None else np.asarray(weight @ shapes)


def _unit(shapes: Shapes, weight: Array | None) -> Shapes:
    """Return columns ``L' a`` of unit length with ``W = L L'``; scaled first, so that nothing overflows."""
    shapes = np.asarray(shapes)
    largest = abs(shapes).max(axis=0, initial=0.0)
    if not (np.isfinite(largest).all() and largest.all()):
        bad = np.flatnonzero(~(np.isfinite(largest) & (largest > 0)))
        raise ValueError(f"shape {bad[0]} is zero or not finite")
    scaled = shapes / largest
    if weight is not None:
        scaled = np.linalg.cholesky(weight).T @ scaled
    return np.asarray(scaled / np.linalg.norm(scaled, axis=0))
