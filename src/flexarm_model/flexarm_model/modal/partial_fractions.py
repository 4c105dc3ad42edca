"""Basis of the modal model: common poles, participations, and remainders of modes out of band.

    H_oi(s) = s^p [ sum_r psi_or L_ri / (s - lambda_r) + conj(psi_or L_ri) / (s - conj(lambda_r))
                    + sum_q R_oiq s^q ]            s = j w

with q = -2 for the modes below the band and q = 0 for those above it. For given poles and
participations H is linear in the shapes psi and the remainders R. Real and imaginary parts of all
lines and inputs of an output are stacked into one column; the columns of different outputs share the
matrix::

    Y (2 k n_in, n_out) = Phi(lambda, L) X        X: Re psi, Im psi by mode; Re R, Im R by power and input
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.modal.frf import Frf

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

REMAINDERS = (-2, 0)  # powers of s: modes below the band, modes above it


@dataclass(frozen=True)
class Basis:
    """The modal model on given lines.

    Attributes:
        s: j w of the lines [rad/s], (k,).
        power: p above.
        n_in: Number of inputs.
        weight: Of every line, (k,).
        remainders: The powers q.
    """

    s: Complex
    power: int
    n_in: int
    weight: Array
    remainders: tuple[int, ...]

    @classmethod
    def of(cls, frf: Frf, weight: Array | None, remainders: tuple[int, ...]) -> Basis:
        """Return the basis on the lines of measured responses; ``weight`` of every line, (k,).

        Raises:
            ValueError: There is a line at 0 Hz, or the weights do not fit the lines.
        """
        weight = np.ones(frf.f_hz.size) if weight is None else np.asarray(weight, dtype=float)
        if weight.shape != frf.f_hz.shape or not (np.isfinite(weight).all() and (weight >= 0.0).all()):
            raise ValueError(f"need {frf.f_hz.size} weights >= 0, one per line, not {weight.shape}")
        if frf.f_hz[0] == 0.0:
            raise ValueError("the fit needs lines above 0 Hz; choose a band")
        return cls(frf.s, frf.power, frf.H.shape[2], weight, remainders)

    def n_linear(self, n_modes: int) -> int:
        """Return the number of real unknowns per output."""
        return 2 * n_modes + 2 * len(self.remainders) * self.n_in

    def data(self, H: Complex) -> Array:
        """Return weighted responses (k, n_out, n_in) as columns Y, (2 k n_in, n_out)."""
        return self._stacked(H.transpose(0, 2, 1) * self.weight[:, None, None])

    def matrix(self, poles: Complex, participation: Complex) -> Array:
        """Return Phi for poles (r,) and participations (r, n_in), (2 k n_in, n_linear)."""
        direct, mirrored = 1 / (self.s - poles[:, None]), 1 / (self.s - poles.conj()[:, None])
        rest = [
            self._stacked(np.einsum("k,ij->kij", self._scale * self.s**q * unit, np.eye(self.n_in)))
            for q in self.remainders
            for unit in (1.0, 1j)
        ]
        return np.hstack([self.mode_columns(direct, mirrored, participation), *rest])

    def mode_columns(self, direct: Complex, mirrored: Complex, participation: Complex) -> Array:
        """Return two columns per mode, of Re psi and Im psi, (2 k n_in, 2 r).

        Args:
            direct: Line shape of every pole, (r, k).
            mirrored: Line shape of its conjugate, (r, k).
            participation: L, (r, n_in).
        """
        one = direct[:, :, None] * participation[:, None, :] * self._scale[None, :, None]  # (r, k, n_in)
        two = mirrored[:, :, None] * participation.conj()[:, None, :] * self._scale[None, :, None]
        pairs = np.stack([one + two, 1j * (one - two)], axis=1)  # (r, 2, k, n_in)
        return self._stacked(pairs.reshape(-1, self.s.size, self.n_in).transpose(1, 2, 0))

    @property
    def _scale(self) -> Complex:
        return np.asarray(self.weight * self.s**self.power)

    def _stacked(self, values: Complex) -> Array:
        """Return (k, n_in, n) complex as (2 k n_in, n) real."""
        flat = values.transpose(1, 0, 2).reshape(self.n_in * self.s.size, -1)
        return np.vstack([flat.real, flat.imag])
