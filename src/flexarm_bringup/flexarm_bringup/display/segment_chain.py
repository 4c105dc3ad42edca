"""Segment joints of one body: how neighbouring stations move against each other as it bends.

The frame of a station follows the shapes of the body's superelement exactly, so from one to the next ::

    T_ab(eta) = T_ab(0) Trans(x, y, z) Rx(a) Ry(b) Rz(c)

with six single-axis joints, of which those that never move are left out. A station stands at
``r + Phi eta + 1/2 eta' G eta``, turned by Cayley's formula with ``h = (Psi eta + 1/2 eta' H eta) / 2``::

    R = (1 - h~)^-1 (1 + h~) = 1 + 2 (h~ + h~^2) / (1 + h' h)
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.superelement import Superelement
from flexarm_model.manipulator.description import AXES

Array = NDArray[np.float64]

UNMOVED = 1e-13  # of a segment joint [m or rad], at coordinates of unit size
DRAWS = 3


class SegmentChain:
    """The segments of one body.

    Attributes:
        pairs: Stations (from, to) of every segment, (k,).
        rest: T_ab of the unbent body, (k, 4, 4).
        axes: Of every segment those of ``AXES`` that move, (k,).
    """

    def __init__(self, shapes: Superelement, pairs: Sequence[tuple[str, str]]) -> None:
        """Look at the pairs of stations of a body."""
        names = list(shapes.nodes)
        nodes = shapes.nodes.values()
        self._r, self._Phi, self._Psi, self._G, self._H = (
            np.array([getattr(node, field) for node in nodes]) for field in ("r", "Phi", "Psi", "G", "H")
        )
        self.pairs = tuple(pairs)
        self._a, self._b = ([names.index(pair[end]) for pair in pairs] for end in (0, 1))
        self.rest = self._between(np.zeros(shapes.n))
        self._back = _inverse(self.rest)
        rng = np.random.default_rng(0)
        moved = np.zeros((len(self.pairs), len(AXES)))
        for _ in range(DRAWS if shapes.n else 0):
            moved = np.maximum(moved, abs(self._positions(rng.standard_normal(shapes.n))))
        self._kept = np.argwhere(moved > UNMOVED).tolist()
        self.axes = tuple(tuple(AXES[j] for i, j in self._kept if i == k) for k in range(len(self.pairs)))
        self._names = [f"{shapes.name}.{self.pairs[i][1]}.{AXES[j]}" for i, j in self._kept]

    def values(self, eta: Array) -> dict[str, float]:
        """Return the position of every segment joint [m or rad] at elastic coordinates (n,)."""
        if not self._kept:
            return {}
        rows, columns = np.array(self._kept).T
        return dict(zip(self._names, self._positions(eta)[rows, columns].tolist(), strict=True))

    def _positions(self, eta: Array) -> Array:
        """Return translations and angles of every segment, (k, 6)."""
        T = self._back @ self._between(eta)
        a = np.arctan2(-T[:, 1, 2], T[:, 2, 2])
        b = np.arcsin(np.clip(T[:, 0, 2], -1.0, 1.0))
        c = np.arctan2(-T[:, 0, 1], T[:, 0, 0])
        return np.column_stack([T[:, :3, 3], a, b, c])

    def _between(self, eta: Array) -> Array:
        """Return T_ab of every segment, (k, 4, 4)."""
        T = self._stations(eta)
        return np.asarray(_inverse(T[self._a]) @ T[self._b])

    def _stations(self, eta: Array) -> Array:
        """Return the frames of all stations in the body, (m, 4, 4)."""
        T = np.tile(np.eye(4), (self._r.shape[0], 1, 1))
        T[:, :3, 3] = self._r + self._Phi @ eta + (self._G @ eta) @ eta / 2.0
        x, y, z = (self._Psi @ eta + (self._H @ eta) @ eta / 2.0).T / 2.0
        h, o = np.zeros((x.size, 3, 3)), 1.0 + x * x + y * y + z * z
        h[:, 0, 1], h[:, 0, 2], h[:, 1, 2] = -z, y, -x
        h -= h.transpose(0, 2, 1)
        T[:, :3, :3] += 2.0 * (h + h @ h) / o[:, None, None]
        return T


def _inverse(T: Array) -> Array:
    """Return the inverses of poses, (k, 4, 4)."""
    back = np.tile(np.eye(4), (T.shape[0], 1, 1))
    turned = T[:, :3, :3].transpose(0, 2, 1)
    back[:, :3, :3] = turned
    back[:, :3, 3] = -(turned @ T[:, :3, 3, None])[:, :, 0]
    return back
