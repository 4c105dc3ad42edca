"""Frequency responses of linear systems, exact or from the first r modes.

With forces ``B u`` and displacements ``y = C x``::

    exact    H(w) = (j w)^p C (K - w^2 M + j w D)^-1 B
    modal    H(w) = (j w)^p sum_r  C phi_r phi_r' B / (omega_r^2 - w^2 + j w 2 zeta_r omega_r)

p = 0 is receptance [m/N], 1 mobility [m/(s N)], 2 accelerance [m/(s^2 N)]; other inputs and
outputs change the units accordingly.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_model.modal.modes import Modes
from flexarm_model.modal.read_only import lock_arrays

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

KINDS = {"receptance": 0, "mobility": 1, "accelerance": 2}  # power of j w over a displacement


@dataclass(frozen=True)
class Frf:
    """A matrix of frequency response functions.

    Attributes:
        f_hz: Lines, ascending [Hz], (k,).
        H: Output per input, (k, n_out, n_in).
        kind: A key of ``KINDS``.
    """

    f_hz: Array
    H: Complex
    kind: str = "receptance"

    def __post_init__(self) -> None:
        """Make the arrays read-only.

        Raises:
            ValueError: Shapes, order of the lines, values or kind are wrong.
        """
        if self.kind not in KINDS:
            raise ValueError(f"kind '{self.kind}' is not one of {', '.join(KINDS)}")
        if self.H.ndim != 3 or self.f_hz.shape != self.H.shape[:1] or not self.H.size:
            raise ValueError(
                f"lines {self.f_hz.shape} do not fit H {self.H.shape}; need (k,), (k, n_out, n_in)"
            )
        if not (np.isfinite(self.H).all() and (np.diff(self.f_hz) > 0).all() and self.f_hz[0] >= 0.0):
            raise ValueError("lines must ascend from 0 Hz or above, and H must be finite")
        lock_arrays(self)

    @property
    def power(self) -> int:
        """Power of j w over a displacement."""
        return KINDS[self.kind]

    @property
    def s(self) -> Complex:
        """Laplace variable j w of the lines [rad/s], (k,)."""
        return np.asarray(2j * np.pi * self.f_hz)

    def db(self, reference: float = 1.0) -> Array:
        """Return the magnitudes in dB of ``reference``, (k, n_out, n_in); -inf where H is zero."""
        with np.errstate(divide="ignore"):
            return np.asarray(20 * np.log10(abs(self.H) / reference))

    def converted(self, kind: str) -> Frf:
        """Return the same responses as receptance, mobility or accelerance.

        Raises:
            ValueError: The kind is unknown, or a line at 0 Hz would have to be integrated.
        """
        if kind not in KINDS:
            raise ValueError(f"kind '{kind}' is not one of {', '.join(KINDS)}")
        step = KINDS[kind] - self.power
        if step < 0 and self.f_hz[0] == 0.0:
            raise ValueError(f"{self.kind} at 0 Hz cannot become {kind}; leave that line out")
        return Frf(self.f_hz, self.H * self.s[:, None, None] ** step, kind)

    def band(self, low_hz: float, high_hz: float) -> Frf:
        """Return the lines in [low_hz, high_hz].

        Raises:
            ValueError: There are none.
        """
        inside = (self.f_hz >= low_hz) & (self.f_hz <= high_hz)
        if not inside.any():
            raise ValueError(
                f"no line in {low_hz}..{high_hz} Hz; lines go from {self.f_hz[0]} to {self.f_hz[-1]}"
            )
        return Frf(self.f_hz[inside], self.H[inside], self.kind)

    def transposed(self) -> Frf:
        """Return the reciprocal matrix: inputs become outputs (a roving hammer reads like roving sensors)."""
        return replace(self, H=self.H.transpose(0, 2, 1))


@dataclass(frozen=True)
class Ports:
    """Where forces enter and displacements are taken.

    Attributes:
        B: Force on the coordinates per unit input, (n, n_in).
        C: Output per unit coordinate, (n_out, n).
    """

    B: Array
    C: Array

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        lock_arrays(self)


def exact_frf(
    f_hz: Array, matrices: tuple[Array, Array, Array], ports: Ports, kind: str = "receptance"
) -> Frf:
    """Return the responses by a direct solution at every line.

    Args:
        f_hz: Lines [Hz], (k,).
        matrices: M, D, K, (n, n) each.
        ports: Inputs and outputs.
        kind: A key of ``KINDS``.

    Raises:
        ValueError: The dynamic stiffness is singular at a line.
    """
    M, D, K = matrices
    H = np.empty((len(f_hz), ports.C.shape[0], ports.B.shape[1]), dtype=complex)
    for i, w in enumerate(2 * np.pi * np.asarray(f_hz, dtype=float)):
        try:
            H[i] = ports.C @ np.linalg.solve(K - w**2 * M + 1j * w * D, ports.B)
        except np.linalg.LinAlgError:
            raise ValueError(f"no response at {f_hz[i]} Hz: an undamped mode lies there") from None
    return _of_kind(f_hz, H, kind)


def modal_frf(f_hz: Array, modes: Modes, ports: Ports, kind: str = "receptance") -> Frf:
    """Return the responses of the given modes alone; ``modes.first(r)`` truncates.

    Args:
        f_hz: Lines [Hz], (k,).
        modes: The modes.
        ports: Where forces act and what is looked at.
        kind: What is told of the outputs, see ``Frf``.

    Raises:
        ValueError: A line meets an undamped mode.
    """
    w = 2 * np.pi * np.asarray(f_hz, dtype=float)[:, None]
    stiffness = modes.omega**2 - w**2 + 1j * w * modes.damping  # (k, r)
    if not stiffness.all():
        raise ValueError(
            f"no response at {f_hz[np.argwhere(stiffness == 0)[0, 0]]} Hz: an undamped mode lies there"
        )
    H = np.einsum("or,kr,ri->koi", ports.C @ modes.shapes, 1 / stiffness, modes.shapes.T @ ports.B)
    return _of_kind(f_hz, H, kind)


def _of_kind(f_hz: Array, H: Complex, kind: str) -> Frf:
    return Frf(np.asarray(f_hz, dtype=float), np.asarray(H, dtype=complex)).converted(kind)
