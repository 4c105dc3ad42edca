"""The projected residual of the modal model and its Jacobian, for Gauss-Newton.

    r(p) = (1 - Phi Phi^+) Y        dr/dp = -(1 - Phi Phi^+) (dPhi/dp) Phi^+ Y

with ``p = [decay; omega_d; Re L; Im L]``: poles ``-decay + j omega_d`` [rad/s] and the free entries of
the participations (the largest of each mode is 1). The Jacobian is Kaufman's [Kaufman1975]; its Gram
matrix is the information on p with everything else unknown.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_model.modal.partial_fractions import Basis
from flexarm_model.modal.residues import solve

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

LARGEST_DECAY = 0.7  # of the highest line; beyond it nothing oscillates
SMALLEST_DECAY = 1e-6  # of the lowest line


class Projection:
    """Residual and Jacobian over p; remembers the last point, at which both are asked for."""

    def __init__(self, basis: Basis, Y: Array, L: Complex) -> None:
        """Set up the problem.

        Args:
            basis: The modal model on the lines.
            Y: Data as columns, (2 k n_in, n_out).
            L: Participations at the start, largest entry 1, (r, n_in).
        """
        self.basis, self.Y, self.L, self.n_modes = basis, Y, L, L.shape[0]
        largest = abs(L).argmax(axis=1)
        self.free = np.argwhere(np.arange(L.shape[1]) != largest[:, None])  # (m, 2): mode and input
        self._at: Array = np.empty(0)
        self._parts: tuple[Array, Array, Array] = (Y, Y, Y)

    @property
    def n_parameters(self) -> int:
        """Length of p."""
        return int(2 * (self.n_modes + len(self.free)))

    def pack(self, poles: Complex, L: Complex) -> Array:
        """Return p of poles (r,) and participations (r, n_in)."""
        entries = L[self.free[:, 0], self.free[:, 1]]
        return np.concatenate([-poles.real, poles.imag, entries.real, entries.imag])

    def unpack(self, p: Array) -> tuple[Complex, Complex]:
        """Return poles (r,) and participations (r, n_in) of p."""
        r, m = self.n_modes, len(self.free)
        L = self.L.copy()
        L[self.free[:, 0], self.free[:, 1]] = p[2 * r : 2 * r + m] + 1j * p[2 * r + m :]
        return np.asarray(-p[:r] + 1j * p[r : 2 * r]), L

    def bounds(self) -> tuple[Array, Array]:
        """Return the smallest and largest p allowed, (n_p,): the band and as much again on both sides."""
        w, free = abs(self.basis.s), np.full(2 * len(self.free), np.inf)
        margin = w[-1] - w[0]
        ones = np.ones(self.n_modes)
        low = np.concatenate([SMALLEST_DECAY * w[0] * ones, max(w[0] - margin, w[0] / 2) * ones, -free])
        high = np.concatenate([LARGEST_DECAY * w[-1] * ones, (w[-1] + margin) * ones, free])
        return low, high

    def scale(self, poles: Complex) -> Array:
        """Return a typical change of p, (n_p,): a bandwidth, or 1 for participations."""
        return np.concatenate([-poles.real, -poles.real, np.ones(2 * len(self.free))])

    def residual(self, p: Array) -> Array:
        """Return what is left of the data, (2 k n_in n_out,)."""
        return self._evaluate(p)[2].ravel()

    def compressed(self, p: Array) -> tuple[Array, Array]:
        """Return J (q, n_p) and r (q,) with the Gram matrix of the Jacobian and the residual, q over n_p.

        A column of the Jacobian is ``D_a psi_a``, ``D_a`` two columns that all outputs share: these alone are
        decomposed, ``[D r] = Q T``, and ``T`` stands for them from there on.
        """
        X, Q, rest = self._evaluate(p)
        D = self._derivatives(p)
        D -= Q @ (Q.T @ D)
        T = np.asarray(np.linalg.qr(np.hstack([D, rest]), mode="r"))
        pairs = T[:, : D.shape[1]].reshape(len(T), -1, 2)
        psi = X[: 2 * self.n_modes].reshape(self.n_modes, 2, -1)
        psi = psi[np.concatenate([np.arange(self.n_modes), self.free[:, 0]])]  # (r + m, 2, n_out)
        turned = np.stack([-psi[:, 1], psi[:, 0]], axis=1)  # j psi
        real, imaginary = (np.einsum("qac,aco->aqo", pairs, shape) for shape in (psi, turned))
        poles, entries = slice(0, self.n_modes), slice(self.n_modes, None)
        changes = np.concatenate([-real[poles], imaginary[poles], real[entries], imaginary[entries]])
        return -changes.reshape(len(changes), -1).T, T[:, D.shape[1] :].ravel()

    def _evaluate(self, p: Array) -> tuple[Array, Array, Array]:
        if not np.array_equal(p, self._at):
            X, Q = solve(self.basis.matrix(*self.unpack(p)), self.Y)
            self._at, self._parts = p.copy(), (X, Q, self.Y - Q @ (Q.T @ self.Y))
        return self._parts

    def _derivatives(self, p: Array) -> Array:
        """Return dPhi by every pole and by every free participation, two columns each, (rows, 2 (r + m))."""
        poles, L = self.unpack(p)
        one = 1 / (self.basis.s - poles[:, None])  # (r, k)
        two = 1 / (self.basis.s - poles.conj()[:, None])
        modes, inputs = self.free.T
        unit = np.zeros((len(self.free), L.shape[1]), dtype=complex)
        unit[np.arange(len(self.free)), inputs] = 1.0
        of_poles = self.basis.mode_columns(one**2, two**2, L)
        return np.hstack([of_poles, self.basis.mode_columns(one[modes], two[modes], unit)])


class JointProjection:
    """Several projections of one p: outputs that count on different lines have bases of their own."""

    def __init__(self, parts: Sequence[Projection]) -> None:
        """Take the parts; what they agree on is asked of the first.

        Args:
            parts: With the same participations at the start.
        """
        self.parts, first = tuple(parts), parts[0]
        self.n_modes, self.n_parameters = first.n_modes, first.n_parameters
        self.pack, self.unpack = first.pack, first.unpack
        self.bounds, self.scale = first.bounds, first.scale

    def residual(self, p: Array) -> Array:
        """Return what is left of the data of all parts, one after the other, (n_data,)."""
        return np.concatenate([part.residual(p) for part in self.parts])

    def compressed(self, p: Array) -> Array:
        """Return ``[J r]`` of all parts with their Gram matrix, (q, n_p + 1)."""
        return np.vstack([np.column_stack(part.compressed(p)) for part in self.parts])

    @property
    def n_spare(self) -> int:
        """Number of equations beyond the unknowns, p and the linear ones."""
        spare = -self.n_parameters
        for part in self.parts:
            equations = 2 * np.count_nonzero(part.basis.weight) * part.basis.n_in
            spare += (equations - part.basis.n_linear(self.n_modes)) * part.Y.shape[1]
        return int(spare)


class Compressed:
    """The same sum of squares with the same gradient and curvature, in as many numbers as p has, and one.

    ``[J r] = Q [T u; 0 c]``, so ``[u; c]`` and ``[T; 0]`` stand for r and J at this p: a step of Gauss-Newton
    needs no more, and its decomposition does not grow with the lines.
    """

    def __init__(self, problem: JointProjection) -> None:
        """Take the problem; its last point is remembered."""
        self._problem = problem
        self._at, self._triangle = np.empty(0), np.empty((0, 0))

    def residual(self, p: Array) -> Array:
        """Return ``[u; c]``, (n_p + 1,)."""
        return np.asarray(self._evaluate(p)[:, -1])

    def jacobian(self, p: Array) -> Array:
        """Return ``[T; 0]``, (n_p + 1, n_p)."""
        return np.asarray(self._evaluate(p)[:, :-1])

    def _evaluate(self, p: Array) -> Array:
        if not np.array_equal(p, self._at):
            both = self._problem.compressed(p)
            self._at, self._triangle = p.copy(), np.asarray(np.linalg.qr(both, mode="r"))
        return self._triangle
