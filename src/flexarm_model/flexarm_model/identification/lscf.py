"""Poles of frequency responses by a right matrix-fraction model, for every order at once [Peeters2004].

With the band's lowest line at the origin, ``z = exp(j 2 pi (f - f_low) T)`` runs once round the unit circle,
and every row of the FRF matrix is ``H_o = B_o(z) A(z)^-1`` with a denominator common to all outputs::

    min over A, B_o   sum_o,k  |B_o(z_k) - H_o(z_k) A(z_k)|^2        A_0 = 1

The numerators are eliminated, so what is solved has n_in (n + 1) unknowns whatever the number of outputs.
With the lowest coefficient fixed, poles that only mathematics needs come out unstable [Cauberghe2005] and
are left out; a structure's pole comes back at every order. Coefficients are complex, since the band
begins at the origin: an order has one pole per input.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.modal.frf import Frf
from flexarm_model.modal.line_weights import shared_weights
from flexarm_model.modal.read_only import lock_arrays

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

EVEN = 1e-6  # relative difference of the distances of lines


@dataclass(frozen=True)
class OrderPoles:
    """Stable poles of one model order inside the band, slowest first.

    Attributes:
        order: Order n of the denominator; it has n n_in poles [1].
        poles: Poles [rad/s], (r,).
        participation: Of the inputs, largest entry 1, (r, n_in).
    """

    order: int
    poles: Complex
    participation: Complex

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        lock_arrays(self)


def poles_of_orders(frf: Frf, orders: range, weight: Array | None = None) -> tuple[OrderPoles, ...]:
    """Return the stable poles in the band for every order.

    Args:
        frf: Responses in the band, evenly spaced lines; the smaller side should be the inputs.
        orders: Orders of the denominator.
        weight: Of every line, (k,), or of every line and output, (k, n_out); 0 masks, None weighs all alike.

    Raises:
        ValueError: The lines are not evenly spaced, or fewer than the largest order needs; there is no order.
    """
    if not orders or min(orders) < 1:
        raise ValueError(f"orders {orders}: expected at least one, from 1 on")
    steps = np.diff(frf.f_hz)
    least = 2 * (orders[-1] + 1)
    if len(frf.f_hz) < least:
        raise ValueError(
            f"{len(frf.f_hz)} lines from {frf.f_hz[0]} to {frf.f_hz[-1]} Hz do not allow order {orders[-1]}: "
            f"needed are at least {least}"
        )
    if not np.allclose(steps, steps[0], rtol=EVEN):
        raise ValueError(
            f"lines from {frf.f_hz[0]} to {frf.f_hz[-1]} Hz are {steps.min():.9g} to {steps.max():.9g} Hz "
            f"apart: needed is one distance, to {EVEN:g} of it; rounded frequencies need more digits"
        )
    period = 1.0 / (steps[0] * len(frf.f_hz))  # s; one turn of z over the band
    normal = _normal_matrix(frf, orders[-1], period, weight)
    return tuple(_poles(normal, order, frf, period) for order in orders)


def _normal_matrix(frf: Frf, n: int, period: float, weight: Array | None) -> Complex:
    """Return what is left for the denominator, ``sum_o T_o - S_o^H R^-1 S_o``, ((n+1) n_in,) * 2."""
    k, n_out, n_in = frf.H.shape
    z = np.exp(2j * np.pi * (frf.f_hz - frf.f_hz[0]) * period)
    turns = z[:, None] ** np.arange(n + 1)  # (k, n + 1)
    size = np.sqrt(np.mean(abs(frf.H) ** 2, axis=(0, 2)))  # every output counts alike
    normal = np.zeros(((n + 1) * n_in,) * 2, dtype=complex)
    for shared in shared_weights(weight, n_out):
        w = np.ones(k) if shared.weight is None else np.asarray(shared.weight, float)
        powers = w[:, None] * turns
        basis, _ = np.linalg.qr(powers)
        for o in shared.outputs:
            row = frf.H[:, o, :] / (size[o] or 1.0)
            Y = (powers[:, :, None] * row[:, None, :]).reshape(k, -1)
            Y = Y - basis @ (basis.conj().T @ Y)
            normal += Y.conj().T @ Y
    return normal


def _poles(normal: Complex, order: int, frf: Frf, period: float) -> OrderPoles:
    n_in = frf.H.shape[2]
    inner = slice(n_in, n_in * (order + 1))
    rest = -np.linalg.lstsq(normal[inner, inner], normal[inner, :n_in], rcond=None)[0]
    blocks = rest.reshape(order, n_in, n_in)  # A_1 ... A_n
    companion = np.zeros((order * n_in,) * 2, dtype=complex)
    companion[:n_in] = -blocks.transpose(1, 0, 2).reshape(n_in, -1)
    companion[n_in:, :-n_in] = np.eye((order - 1) * n_in)
    values, vectors = np.linalg.eig(companion)  # 1/z where A(z) v = 0; v stands at the bottom
    with np.errstate(divide="ignore", invalid="ignore"):
        s = -np.log(values) / period
    turn = 2 * np.pi / period
    s = s.real + 1j * np.mod(s.imag, turn) + 2j * np.pi * frf.f_hz[0]
    inside = (s.real < 0) & (s.imag > 2 * np.pi * frf.f_hz[0]) & (s.imag < 2 * np.pi * frf.f_hz[-1])
    has_part = abs(vectors[-n_in:]).max(axis=0) > 0  # none far outside the unit circle, by underflow
    keep = np.flatnonzero(inside & np.isfinite(s) & has_part)
    keep = keep[np.argsort(abs(s[keep]), kind="stable")]
    v = vectors[-n_in:, keep].T
    v = v / np.take_along_axis(v, abs(v).argmax(axis=1)[:, None], axis=1) if keep.size else v
    return OrderPoles(order, s[keep], v)
