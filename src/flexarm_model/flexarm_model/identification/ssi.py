"""Modes from outputs alone, when nobody measured what excites: covariance-driven subspaces [Peeters1999].

With ``R_i = <y_{k+i} y_k'>`` of a white excitation, ``R_i = C A^(i-1) G``, so that the block Toeplitz matrix
of the covariances is the product of an observability and a controllability matrix::

    T = [R_p ... R_1; ...; R_2p-1 ... R_p] = O Gamma        O[:-m] A = O[m:]        lambda = ln(eig A) rate

A singular value decomposition gives ``O`` for every order at once. Every ``R_i`` is a mean over the same k:
where something rings down, ``x_{k+1} = A x_k``, it is ``C A^i <x_k y_k'>``, so that its modes come out, too.

The uncertainty is that of the mean over parts of the record, widened by Student's factor for as few as they
are, and how far that mean is from the whole record's value. Two or three of them may agree by chance: of a
white excitation it is never below what no method can do better, from all of the record's T seconds [Au2014],
the same number for frequency and damping::

    sigma_f / f = sigma_zeta = sqrt(zeta / (2 pi f T))

What excites at a frequency of its own
(a motor that hums) shows as a mode of hardly any damping; the chart cannot tell it from one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_model.identification.joined_tracks import lasting_modes
from flexarm_model.identification.lscf import OrderPoles
from flexarm_model.identification.ring_down import rings_down
from flexarm_model.modal.read_only import lock_arrays

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
Mask = NDArray[np.bool_]
PERIODS = 2.0  # of the begin of the band that the covariances reach over
TURNS = 4  # parts of what rings down; each has its turn for one such period
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
        f_std_hz: One sigma of them [Hz], (r,).
        zeta_std: Of the damping [1], (r,).
        shapes: At the outputs, largest entry 1, (r, n_out).
        parts: Of the record that show a mode, (r,).
        of_parts: Of how many.
        rings_down: The record is of something that rings down: no white excitation.
        dropped: What the whole record shows, but too few of its parts.
    """

    f_hz: Array
    zeta: Array
    f_std_hz: Array
    zeta_std: Array
    shapes: Complex
    parts: NDArray[np.int64]
    of_parts: int
    rings_down: bool
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
        parts: Of the record, each by itself, for the uncertainty; of what rings down there are four.

    Raises:
        ValueError: The record is not finite, or a part of it too short for the band.
    """
    f, zeta, shapes = _modes(y, rate_hz, band_hz)
    decays = rings_down(y)
    parts = TURNS if decays else parts
    spread = np.full((2, f.size, parts), np.nan)
    pieces = _in_turns(y, int(rate_hz / band_hz[0])) if decays else _one_by_one(y, parts)
    for part, (piece, counts) in enumerate(pieces):
        f_part, zeta_part, _ = _modes(piece, rate_hz, band_hz, counts)
        apart = abs(f_part[None, :] / f[:, None] - 1.0)
        for i, near in zip(*scipy.optimize.linear_sum_assignment(np.minimum(apart, SAME_MODE)), strict=True):
            if apart[i, near] < SAME_MODE:  # each shows one mode of the whole record at most
                spread[:, i, part] = f_part[near], zeta_part[near]
    shown = np.isfinite(spread[0]).sum(axis=1)
    there = shown > MOST_PARTS * parts
    std = _about(np.stack([f, zeta]), spread)
    if not decays:
        white = np.sqrt(zeta / (2 * np.pi * f * len(y) / rate_hz))
        std = np.maximum(std, [f * white, white])
    dropped = tuple(
        Dropped(float(f[i]), float(zeta[i]), int(shown[i]), parts) for i in np.flatnonzero(~there)
    )
    return OutputModes(
        f[there], zeta[there], std[0, there], std[1, there], shapes[there], shown[there], parts, decays,
        dropped,
    )  # fmt: skip


def _one_by_one(y: Array, parts: int) -> list[tuple[Array, Mask]]:
    """Return parts of a record, one after the other, and that all of their samples count."""
    return [(piece, np.ones(len(piece), bool)) for piece in np.array_split(y, parts)]


def _in_turns(y: Array, turn: int) -> list[tuple[Array, Mask]]:
    """Return the record for each part, and its samples that count, every turn another part's.

    Of what rings down, the last of parts one after the other would hold noise alone.
    """
    whose = np.arange(len(y)) // max(turn, 1) % TURNS
    return [(y, whose == part) for part in range(TURNS)]


def _of_the_mean(values: Array) -> Array:
    """Return one sigma of the mean of few values, those that are numbers; of one not a number, (..., n)."""
    count = np.isfinite(values).sum(axis=-1)
    mean = np.nansum(values, axis=-1) / np.maximum(count, 1)
    squares = np.nansum((values - mean[..., None]) ** 2, axis=-1)
    few = scipy.special.stdtrit(count - 1, scipy.special.ndtr(1.0))  # Student's factor
    return np.asarray(few * np.sqrt(squares / np.maximum(count * (count - 1), 1)))


def _about(told: Array, values: Array) -> Array:
    """Return one sigma of what is told of the whole, (...,), by few values of parts, (..., n).

    It is that of their mean, and how far this is from what is told: parts that contradict it are no proof.
    """
    count = np.isfinite(values).sum(axis=-1)
    mean = np.nansum(values, axis=-1) / np.maximum(count, 1)
    return np.asarray(np.hypot(_of_the_mean(values), np.where(count > 0, told - mean, 0.0)))


def _modes(
    y: Array, rate_hz: float, band_hz: tuple[float, float], counts: Mask | None = None
) -> tuple[Array, Array, Complex]:
    chart = output_poles(y, rate_hz, band_hz, counts)
    found = [track for track in lasting_modes(chart) if -track.pole.real < LARGEST_DAMPING * abs(track.pole)]
    poles = np.array([track.pole for track in found])
    shapes = np.array([track.participation for track in found]).reshape(len(found), y.shape[1])
    shapes = shapes * y.std(axis=0)  # the covariances are of signals of unit size
    size = np.maximum(abs(poles), np.finfo(float).tiny)
    return np.asarray(size / (2 * np.pi)), np.asarray(-poles.real / size), np.asarray(shapes, complex)


def output_poles(
    y: Array, rate_hz: float, band_hz: tuple[float, float], counts: Mask | None = None
) -> tuple[OrderPoles, ...]:
    """Return the stable poles in the band for every even order, with their shapes at the outputs.

    Args:
        y: Outputs, evenly sampled, (samples, n_out).
        rate_hz: Samples per second [Hz].
        band_hz: Band of the poles [Hz].
        counts: Which samples the covariances are means over, (samples,); None for all.

    Raises:
        ValueError: The record is not finite or too short for the band, or the band is none.
    """
    m, reach = y.shape[1], _reach(y, rate_hz, band_hz)
    y = (y - y.mean(axis=0)) / np.maximum(y.std(axis=0), np.finfo(float).tiny)
    k = np.arange(len(y) - 2 * reach)  # the same samples for every lag
    k = k if counts is None else k[counts[: k.size]]
    R = [y[k + i].T @ y[k] / k.size for i in range(2 * reach)]
    T = np.block([[R[reach + i - j] for j in range(reach)] for i in range(reach)])
    U, s, _ = np.linalg.svd(T)
    O = U * np.sqrt(s)  # noqa: E741
    orders = range(2, min(MOST_ORDER, (reach - 1) * m) + 1, 2)
    return tuple(_at_order(O[:, :n], n, m, rate_hz, band_hz) for n in orders)


def _reach(y: Array, rate_hz: float, band_hz: tuple[float, float]) -> int:
    """Return over how many samples the covariances reach; raises what ``output_poles`` does."""
    low, high = band_hz
    if not 0.0 < low < high:
        raise ValueError(f"band {low:g} to {high:g} Hz: expected a lower end above 0 Hz, below the upper one")
    reach: int = max(4, int(np.ceil(PERIODS * rate_hz / low)), -(-MOST_ORDER // y.shape[1]))
    if not np.isfinite(y).all() or len(y) < 20 * reach:
        raise ValueError(
            f"a record of {len(y)} samples is not finite or too short: {20 * reach} are needed from "
            f"{low:g} Hz on"
        )
    return reach


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
