r"""Integrals of the matrix exponential over any time, from coefficients computed once.

With ``x' = A x + G w``, white ``w`` of intensity S and ``Qc = G S G'``, over a period ``h``::

    E(h) = e^{A h}     I(h) = int_0^h e^{A s} ds     Q(h) = int_0^h e^{A s} Qc e^{A' s} ds

For ``|A| h <= 1`` the Taylor series of I and Q are exact to rounding (24 terms; those of Q grow as
``2 |A|``), longer periods are doubled: ``I(2h) = I + E I``, ``Q(2h) = Q + E Q E'`` [Higham2005].
Stamps that jitter need a new period at every sample: this costs 10 us, two matrix exponentials 500.

The derivatives of E and I when A changes by ``p N`` follow by the product rule, term by term.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flexarm_model.numeric.balance import balance

Array = NDArray[np.float64]
_TERMS = 24  # 2^24 / 24! = 3e-17
_POWERS = np.arange(1.0, _TERMS + 1.0)


class ExponentialIntegrals:
    """E, I and Q of one linear system as functions of time."""

    def __init__(self, A: Array, Qc: Array) -> None:
        """Compute the coefficients.

        Args:
            A: System matrix, (n, n).
            Qc: Intensity of the white noise on x, (n, n).
        """
        n = A.shape[0]
        self._A = A
        self._norm = _balanced_norm(A)
        first, second = np.empty((_TERMS, n, n)), np.empty((_TERMS, n, n))
        first[0], second[0] = np.eye(n), Qc
        for k in range(1, _TERMS):
            first[k] = A @ first[k - 1] / (k + 1)
            drift = A @ second[k - 1]
            second[k] = (drift + drift.T) / (k + 1)
        self._first, self._second = first.reshape(_TERMS, n * n), second.reshape(_TERMS, n * n)
        self._identity = np.eye(n)

    def at(self, h: float) -> tuple[Array, Array, Array]:
        """Return E, I and Q after ``h`` seconds, (n, n) each."""
        doublings = _doublings(self._norm, h)
        powers = (h * 0.5**doublings) ** _POWERS
        shape = self._A.shape
        first, second = powers.dot(self._first).reshape(shape), powers.dot(self._second).reshape(shape)
        for _ in range(doublings):
            E = self._identity + self._A.dot(first)
            first = first + E.dot(first)
            second = second + E.dot(second).dot(E.T)
        return self._identity + self._A.dot(first), first, (second + second.T) * 0.5


class IntegralSlopes:
    """Derivatives of E and I when A changes in one direction."""

    def __init__(self, A: Array, N: Array) -> None:
        """Compute the coefficients.

        Args:
            A: System matrix, (n, n).
            N: Its change per unit of a parameter, (n, n).
        """
        n = A.shape[0]
        self._A, self._N = A, N
        self._norm = _balanced_norm(A)
        first, slope = np.empty((_TERMS, n, n)), np.zeros((_TERMS, n, n))
        first[0] = np.eye(n)
        for k in range(1, _TERMS):
            first[k] = A @ first[k - 1] / (k + 1)
            slope[k] = (A @ slope[k - 1] + N @ first[k - 1]) / (k + 1)
        self._first, self._slope = first.reshape(_TERMS, n * n), slope.reshape(_TERMS, n * n)

    def at(self, h: float) -> tuple[Array, Array]:
        """Return the derivatives of E and I after ``h`` seconds, (n, n) each."""
        doublings = _doublings(self._norm, h)
        powers = (h * 0.5**doublings) ** _POWERS
        shape = self._A.shape
        first, slope = powers.dot(self._first).reshape(shape), powers.dot(self._slope).reshape(shape)
        for _ in range(doublings):
            E = self._A.dot(first)
            E.flat[:: shape[0] + 1] += 1.0
            slope = slope + (self._N.dot(first) + self._A.dot(slope)).dot(first) + E.dot(slope)
            first = first + E.dot(first)
        return self._N.dot(first) + self._A.dot(slope), slope


def _balanced_norm(A: Array) -> float:
    return float(np.linalg.norm(balance(A)[0], 1))


def _doublings(norm: float, h: float) -> int:
    return max(0, math.ceil(math.log2(max(norm * h, 1e-300))))
