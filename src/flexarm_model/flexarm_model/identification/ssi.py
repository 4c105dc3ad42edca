"""Modes from outputs alone, when nobody measured what excites: covariance-driven subspaces [Peeters1999].

With ``R_i = <y_{k+i} y_k'>`` of a white excitation, ``R_i = C A^(i-1) G``, so that the block Toeplitz matrix
of the covariances is the product of an observability and a controllability matrix::

    T = [R_p ... R_1; ...; R_2p-1 ... R_p] = O Gamma        O[:-m] A = O[m:]        lambda = ln(eig A) rate

A singular value decomposition gives ``O`` for every order at once. What excites at a frequency of its own
(a motor that hums) shows as a mode of hardly any damping; the chart cannot tell it from one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_model.identification.joined_tracks import lasting_modes
from flexarm_model.identification.lscf import OrderPoles
from flexarm_model.modal.read_only import lock_arrays

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
PERIODS = 2.0  # of the slowest mode that the covariances reach over
MOST_ORDER = 60
LARGEST_DAMPING = 0.3
SAME_MODE = 0.02  # relative distance of frequencies in the whole record and in a part of it
MOST_PARTS = 0.6  # share of the parts in which a mode must show, too


@dataclass(frozen=True)
class Dropped:
    """A mode of the whole record that too few of its parts show.

    Attributes:
        f_hz: Its natural frequency [Hz].
        zeta: Its damping ratio [1].
        parts: That show it.
        of_parts: Of how many.
    """

    f_hz: float
    zeta: float
    parts: int
    of_parts: int


@dataclass(frozen=True)
class OutputModes:
    """Modes found in outputs alone, slowest first; each in most parts of the record, too.

    Attributes:
        f_hz: Natural frequencies [Hz], (r,).
        zeta: Damping ratios [1], (r,).
        f_std_hz: Scatter over the parts of the record [Hz], (r,).
        zeta_std: Of the damping [1], (r,).
        shapes: At the outputs, largest entry 1, (r, n_out).
        dropped: What the whole record shows, but too few of its parts.
    """

    f_hz: Array
    zeta: Array
    f_std_hz: Array
    zeta_std: Array
    shapes: Complex
    dropped: tuple[Dropped, ...] = ()

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        lock_arrays(self)


def output_modes(
    y: Array,
    rate_hz: float,
    band_hz: tuple[float, float],
    parts: int = 4,
) -> OutputModes:
    """Return the modes in a band.

    Args:
        y: Outputs, evenly sampled, (samples, n_out).
        rate_hz: Samples per second [Hz].
        band_hz: Band of the modes; its lower end sets how far the covariances reach [Hz].
        parts: Of the record, each by itself, for the uncertainty.

    Raises:
        ValueError: The record is not finite, or a part of it too short for the band.
    """
    f, zeta, shapes = _modes(y, rate_hz, band_hz)
    spread = np.full((2, f.size, parts), np.nan)
    for part, piece in enumerate(np.array_split(y, parts)):
        f_part, zeta_part, _ = _modes(piece, rate_hz, band_hz)
        apart = abs(f_part[None, :] / f[:, None] - 1.0)
        for i, near in zip(*scipy.optimize.linear_sum_assignment(np.minimum(apart, SAME_MODE)), strict=True):
            if apart[i, near] < SAME_MODE:  # each shows one mode of the whole record at most
                spread[:, i, part] = f_part[near], zeta_part[near]
    shown = np.isfinite(spread[0]).sum(axis=1)
    there = shown > MOST_PARTS * parts
    std = np.nanstd(spread[:, there], axis=2, ddof=1) / np.sqrt(parts)
    dropped = tuple(
        Dropped(float(f[i]), float(zeta[i]), int(shown[i]), parts) for i in np.flatnonzero(~there)
    )
    return OutputModes(f[there], zeta[there], std[0], std[1], shapes[there], dropped)


def _modes(y: Array, rate_hz: float, band_hz: tuple[float, float]) -> tuple[Array, Array, Complex]:
    chart = output_poles(y, rate_hz, band_hz)
    found = [track for track in lasting_modes(chart) if -track.pole.real < LARGEST_DAMPING * abs(track.pole)]
    poles = np.array([track.pole for track in found])
    shapes = np.array([track.participation for track in found]).reshape(len(found), y.shape[1])
    shapes = shapes * y.std(axis=0)  # the covariances are of signals of unit size
    size = np.maximum(abs(poles), np.finfo(float).tiny)
    return np.asarray(size / (2 * np.pi)), np.asarray(-poles.real / size), np.asarray(shapes, complex)


def output_poles(y: Array, rate_hz: float, band_hz: tuple[float, float]) -> tuple[OrderPoles, ...]:
    """Return the stable poles in the band for every even order, with their shapes at the outputs.

    Args:
        y: Outputs, evenly sampled, (samples, n_out).
        rate_hz: Samples per second [Hz].
        band_hz: Band of the poles [Hz].

    Raises:
        ValueError: The record is not finite or too short for the band, or the band is none.
    """
    low, high = band_hz
    if not 0.0 < low < high:
        raise ValueError(f"band {low:g} to {high:g} Hz: expected a lower end above 0 Hz, below the upper one")
    m = y.shape[1]
    reach = max(4, int(np.ceil(PERIODS * rate_hz / band_hz[0])), -(-MOST_ORDER // m))
    if not np.isfinite(y).all() or len(y) < 20 * reach:
        raise ValueError(
            f"a record of {len(y)} samples is not finite or too short: {20 * reach} are needed from "
            f"{band_hz[0]:g} Hz on"
        )
    y = (y - y.mean(axis=0)) / np.maximum(y.std(axis=0), np.finfo(float).tiny)
    R = [y[i:].T @ y[: len(y) - i] / (len(y) - i) for i in range(2 * reach)]
    T = np.block([[R[reach + i - j] for j in range(reach)] for i in range(reach)])
    U, s, _ = np.linalg.svd(T)
    O = U * np.sqrt(s)  # noqa: E741
    orders = range(2, min(MOST_ORDER, (reach - 1) * m) + 1, 2)
    return tuple(_at_order(O[:, :n], n, m, rate_hz, band_hz) for n in orders)


def _at_order(O: Array, n: int, m: int, rate_hz: float, band_hz: tuple[float, float]) -> OrderPoles:  # noqa: E741
    A = np.linalg.lstsq(O[:-m], O[m:], rcond=None)[0]
    values, vectors = (np.asarray(part, dtype=np.complex128) for part in np.linalg.eig(A))
    with np.errstate(divide="ignore"):
        s = np.asarray(np.log(values) * rate_hz, dtype=np.complex128)
    f = abs(s) / (2 * np.pi)
    keep = np.flatnonzero((s.imag > 0) & (s.real < 0) & (f >= band_hz[0]) & (f <= band_hz[1]))
    keep = keep[np.argsort(f[keep], kind="stable")]
    shapes = (O[:m] @ vectors[:, keep]).T
    top = np.take_along_axis(shapes, abs(shapes).argmax(axis=1)[:, None], axis=1) if keep.size else 1.0
    return OrderPoles(n, s[keep], shapes / top)
