"""Residues and remainders of measured responses for known poles: linear least squares.

The poles are common to all responses. Without participations every response has a residue of its own;
with them the residues of a mode are of rank one, ``A_r = psi_r L_r'``, as those of a real mode are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.modal.frf import Frf
from flexarm_model.modal.line_weights import repeated_weights, shared_weights
from flexarm_model.modal.modes import frequency_and_damping
from flexarm_model.modal.partial_fractions import REMAINDERS, Basis
from flexarm_model.modal.read_only import lock_arrays

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

RANK_TOLERANCE = 1e-10  # of the columns scaled to unit length


class UnderdeterminedError(ValueError):
    """The data cannot tell the unknowns; the message gives both numbers or the poles in question."""


@dataclass(frozen=True)
class ModalFit:
    """A modal model of measured responses.

    Attributes:
        poles: In the upper half plane, slowest first [rad/s], (r,).
        residues: Of the receptances at the poles [m/(N s)], (r, n_out, n_in).
        powers: Powers of j w of the remainders.
        remainders: Modes below and above the band [m/N (rad/s)^-power], (len(powers), n_out, n_in).
        kind: Of the responses it was fitted to, a key of ``KINDS``.
        error: Root mean square of what is left over that of the data [1].
    """

    poles: Complex
    residues: Complex
    powers: tuple[int, ...]
    remainders: Complex
    kind: str
    error: float

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        lock_arrays(self)

    @property
    def f_hz(self) -> Array:
        """Natural frequencies [Hz], (r,)."""
        return frequency_and_damping(self.poles)[0]

    @property
    def zeta(self) -> Array:
        """Damping ratios [1], (r,)."""
        return frequency_and_damping(self.poles)[1]

    def frf(self, f_hz: Array) -> Frf:
        """Return the responses of the model on any lines above 0 Hz, (k,)."""
        s = 2j * np.pi * np.asarray(f_hz, dtype=float)[:, None]
        H = np.einsum("kr,roi->koi", 1 / (s - self.poles), self.residues)
        H += np.einsum("kr,roi->koi", 1 / (s - self.poles.conj()), self.residues.conj())
        H += np.einsum("kq,qoi->koi", s ** np.array(self.powers, dtype=float), self.remainders)
        return Frf(np.asarray(f_hz, dtype=float), H).converted(self.kind)

    def modal_stiffness(self, direction: Array) -> Array:
        """Return the stiffness of every mode along its own motion at one drive point [N/m], (r,).

        With the residue ``A = phi phi' e / (2 j omega_d)`` of a force along ``e`` at the point where the
        outputs are taken along axes of the same frame, ``k = omega^2 / |phi|^2`` for any ``e`` that
        excites the mode.

        Args:
            direction: Unit vector of the only input, in the axes of the outputs, (n_out,).

        Raises:
            ValueError: There are several inputs.
        """
        if self.residues.shape[2] != 1:
            raise ValueError(f"{self.residues.shape[2]} inputs; a drive point has one")
        motion = self.residues[:, :, 0] * (2j * self.poles.imag[:, None])  # phi (phi' e), (r, n_out)
        along = abs(motion @ direction)
        return np.asarray(abs(self.poles) ** 2 * along / np.sum(abs(motion) ** 2, axis=1))

    def shapes(self, drive: tuple[int, int]) -> Complex:
        """Return mass-normalised shapes at the outputs [kg^-1/2], (r, n_out); real for real modes.

        Args:
            drive: Output and input that are the same point and direction.
        """
        o, i = drive
        motion = self.residues[:, :, i] * (2j * self.poles.imag[:, None])  # phi phi_drive
        return np.asarray(motion / np.sqrt(motion[:, o])[:, None])


def fit_residues(
    frf: Frf,
    poles: Complex,
    participation: Complex | None = None,
    weight: Array | None = None,
    remainders: tuple[int, ...] = REMAINDERS,
) -> ModalFit:
    """Return the modal model with given poles.

    Args:
        frf: Measured responses.
        poles: In the upper half plane [rad/s], (r,).
        participation: Of the inputs in the modes, (r, n_in); None leaves every residue free.
        weight: Of every line, (k,), or of every line and output, (k, n_out); 0 masks.
        remainders: Powers of j w for the modes out of band; () for none.

    Raises:
        UnderdeterminedError: Fewer equations than unknowns, or poles that coincide.
    """
    poles = np.asarray(poles, dtype=complex)
    if poles.ndim != 1 or not poles.size or not (np.isfinite(poles).all() and (poles.imag > 0.0).all()):
        raise ValueError(f"need poles with positive imaginary part, not {poles}")
    shape = frf.H.shape
    split = frf if participation is not None else as_one_input(frf)
    L = np.ones((poles.size, 1), dtype=complex) if participation is None else participation
    n_in, columns = split.H.shape[2], split.H.shape[1]
    X = np.zeros((2 * poles.size + 2 * len(remainders) * n_in, columns))
    left, whole = 0.0, 0.0
    for shared in shared_weights(repeated_weights(weight, columns // shape[1]), columns):
        basis = Basis.of(split, shared.weight, remainders)
        check_determined(basis, poles.size, shared.outputs.size, 0)
        Y = basis.data(split.H[:, shared.outputs])
        X[:, shared.outputs], Q = solve(basis.matrix(poles, L), Y)
        left += float(np.sum((Y - Q @ (Q.T @ Y)) ** 2))
        whole += float(np.sum(Y**2))
    psi = X[: 2 * poles.size : 2] + 1j * X[1 : 2 * poles.size : 2]  # (r, n_out)
    rest = X[2 * poles.size :].reshape(len(remainders), 2, n_in, columns)
    order = np.argsort(abs(poles), kind="stable")
    residues = np.einsum("ro,ri->roi", psi, L)[order]
    return ModalFit(
        poles[order],
        residues.reshape(poles.size, *shape[1:]),
        remainders,
        (rest[:, 0] + 1j * rest[:, 1]).transpose(0, 2, 1).reshape(len(remainders), *shape[1:]),
        frf.kind,
        float(np.sqrt(left / max(whole, np.finfo(float).tiny))),
    )


def as_one_input(frf: Frf) -> Frf:
    """Return the same responses as outputs of one input, (k, n_out * n_in, 1)."""
    return Frf(frf.f_hz, frf.H.reshape(frf.f_hz.size, -1, 1), frf.kind)


def check_determined(basis: Basis, n_modes: int, n_out: int, n_nonlinear: int) -> None:
    """Refuse a fit with more unknowns than equations.

    Raises:
        UnderdeterminedError: Says how many there are of each.
    """
    lines = int(np.count_nonzero(basis.weight))
    equations = 2 * lines * basis.n_in * n_out
    unknowns = basis.n_linear(n_modes) * n_out + n_nonlinear
    if equations < unknowns:
        raise UnderdeterminedError(
            f"{lines} lines of {n_out} x {basis.n_in} responses give {equations} equations for {unknowns} "
            f"unknowns ({n_modes} modes, {len(basis.remainders)} remainders); more lines or fewer modes"
        )


def solve(Phi: Array, Y: Array) -> tuple[Array, Array]:
    """Return X (q, m) of ``Phi X = Y`` in least squares and an orthonormal basis of Phi (n, q).

    Raises:
        UnderdeterminedError: Columns depend on each other.
    """
    length = np.linalg.norm(Phi, axis=0)
    if not length.all():
        raise UnderdeterminedError("a mode takes no part in the responses; its participation is zero")
    Q, R = np.linalg.qr(Phi / length)
    diagonal = abs(np.diag(R))
    if diagonal.min() < RANK_TOLERANCE:
        raise UnderdeterminedError(
            "modes or remainders cannot be told apart: poles coincide, or too few lines"
        )
    return np.linalg.solve(R, Q.T @ Y) / length[:, None], Q
