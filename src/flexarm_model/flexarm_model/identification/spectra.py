"""Frequency responses and coherence from records of inputs and outputs.

With averaged cross spectra ``G_yx = <Y X^H>``, every line by itself::

    H1 = G_yx G_xx^-1                       noise on the outputs only
    H2 = G_yy G_xy^-1  (one input)          noise on the input only
    Hv = smallest eigenvector of [G_xx G_xy; G_yx G_yy], each signal by its own power   noise on both
    Hc = G_yr G_xr^-1                       r, the signal that was asked for, is the instrument

For one input Hv has the phase of H1 and the geometric mean of the magnitudes of H1 and H2 [Rocklin1985].
The multiple coherence is the share of an output's power that the inputs (for Hc: r) explain; where it is
low, a response is a guess.

Under feedback ``x = r - C (y + n)`` the input carries the outputs' noise n, so that H1 tends to ``-1/C``
where r is weak, and averaging does not help. r knows nothing of n: both of Hc's cross spectra lose it, which
leaves ``G_yr G_xr^-1 = P S G_rr (S G_rr)^-1 = P`` with ``S = (1 + C P)^-1`` [Goyder1984].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from flexarm_model.modal.frf import Frf
from flexarm_model.modal.read_only import lock_arrays

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
ESTIMATORS = ("H1", "H2", "Hv")
BY_INSTRUMENT = "Hc"
ALIKE = 1e12  # condition number from which inputs are the same
NOTHING = 1e-24  # of the largest power: a line that was not driven


@dataclass(frozen=True)
class SpectrumSettings:
    """How records become spectra.

    Attributes:
        block: Samples per block; its inverse times the rate is the distance of the lines.
        overlap: Share of a block that the next one uses again [1].
        window: Name of a window of scipy.signal, e.g. "hann"; "boxcar" for transients that have died out.
        estimator: One of ``ESTIMATORS``, or ``BY_INSTRUMENT``.
    """

    block: int
    overlap: float = 0.5
    window: str = "hann"
    estimator: str = "H1"

    def __post_init__(self) -> None:
        """Check.

        Raises:
            ValueError: A value is outside its range.
        """
        if (
            self.block < 4
            or not 0.0 <= self.overlap < 1.0
            or self.estimator not in (*ESTIMATORS, BY_INSTRUMENT)
        ):
            raise ValueError(
                f"block {self.block} must be at least 4, overlap {self.overlap} in [0, 1), "
                f"estimator '{self.estimator}' one of {', '.join(ESTIMATORS)}"
            )


@dataclass(frozen=True)
class MeasuredFrf:
    """Responses as measured.

    Attributes:
        frf: The responses.
        coherence: Multiple coherence, nan at lines without power, (k, n_out).
    """

    frf: Frf
    coherence: Array

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        lock_arrays(self)


@dataclass(frozen=True)
class BlockSpectra:
    """Spectra of single blocks, which may be averaged in any selection (bootstrap).

    Attributes:
        f_hz: Lines [Hz], (k,).
        spectra: Of inputs, then outputs, then instruments, (blocks, k, n_in + n_out + n_ref).
        n_in: Number of inputs.
        n_ref: Number of instruments; 0 or that of the inputs.
    """

    f_hz: Array
    spectra: Complex
    n_in: int
    n_ref: int = 0

    def frf(self, estimator: str, kind: str, picks: NDArray[np.intp] | None = None) -> MeasuredFrf:
        """Return the responses from all blocks, or from those picked, (n_picks,), with repetitions.

        Raises:
            ValueError: There are fewer blocks than inputs, several inputs for H2, inputs that cannot be told
                apart, or no instruments for Hc.
        """
        if estimator == "H2" and self.n_in > 1:
            raise ValueError(f"H2 needs one input, there are {self.n_in}; take H1 or Hv")
        if estimator == BY_INSTRUMENT and self.n_ref != self.n_in:
            raise ValueError(f"Hc needs one instrument per input: {self.n_ref} for {self.n_in}; take H1")
        spectra = self.spectra if picks is None else self.spectra[picks]
        if len(spectra) < self.n_in:
            raise ValueError(f"{len(spectra)} block(s) cannot part {self.n_in} inputs; record longer")
        lines = spectra.swapaxes(0, 1)  # (k, blocks, channels)
        G = lines.swapaxes(1, 2) @ lines.conj() / len(spectra)
        end = G.shape[1] - self.n_ref
        if estimator == BY_INSTRUMENT:
            H, coherence = _by_instrument(G, self.n_in, end)
        else:
            H, coherence = _responses(G[:, :end, :end], self.n_in, estimator)
        return MeasuredFrf(Frf(self.f_hz, H, kind), coherence)


def block_spectra(
    x: Sequence[Array],
    y: Sequence[Array],
    rate_hz: float,
    settings: SpectrumSettings,
    instruments: Sequence[Array] = (),
) -> BlockSpectra:
    """Cut records into blocks and transform them.

    Args:
        x: Records of the inputs, evenly sampled, one array (samples, n_in) per run.
        y: Of the outputs at the same instants, (samples, n_out) per run.
        rate_hz: Samples per second [Hz].
        settings: Blocks and window.
        instruments: Signals that were asked for, one per input, for Hc; none where nobody knows them.

    Raises:
        ValueError: Records do not fit each other, are shorter than a block or not finite.
    """
    groups = zip(x, y, *([instruments] if instruments else []), strict=True)
    blocks = [_blocks(np.hstack(group), settings) for group in groups]
    spectra = np.fft.rfft(np.concatenate(blocks), axis=1)
    f_hz = np.asarray(np.fft.rfftfreq(settings.block, 1.0 / rate_hz), float)
    return BlockSpectra(f_hz, spectra, x[0].shape[1], instruments[0].shape[1] if instruments else 0)


def measure_frf(
    x: Sequence[Array],
    y: Sequence[Array],
    rate_hz: float,
    settings: SpectrumSettings,
    kind: str = "receptance",
) -> MeasuredFrf:
    """Return the responses of outputs ``y`` to inputs ``x``; ``kind``: what an output is of a displacement.

    Raises:
        ValueError: See ``block_spectra`` and ``BlockSpectra.frf``.
    """
    return block_spectra(x, y, rate_hz, settings).frf(settings.estimator, kind)


def _blocks(record: Array, settings: SpectrumSettings) -> Array:
    """Return the windowed blocks of a record without their means, (blocks, block, channels)."""
    if record.ndim != 2 or len(record) < settings.block or not np.isfinite(record).all():
        raise ValueError(f"a record {record.shape} is shorter than a block of {settings.block} or not finite")
    hop = max(1, round(settings.block * (1 - settings.overlap)))
    cut = sliding_window_view(record, settings.block, axis=0)[::hop].swapaxes(1, 2)
    window = scipy.signal.get_window(settings.window, settings.block)
    mean = cut.mean(axis=1, keepdims=True) if settings.window != "boxcar" else 0.0
    return np.asarray((cut - mean) * window[:, None])


def _responses(G: Complex, n_in: int, estimator: str) -> tuple[Complex, Array]:
    """Return H, (k, n_out, n_in), and the multiple coherence, (k, n_out)."""
    G_xx, G_xy, G_yx, G_yy = G[:, :n_in, :n_in], G[:, :n_in, n_in:], G[:, n_in:, :n_in], G[:, n_in:, n_in:]
    level = np.abs(np.einsum("kii->ki", G_xx)).max(axis=1)
    dead = level <= level.max() * np.finfo(float).eps ** 2
    safe = G_xx + np.where(dead, 1.0, 0.0)[:, None, None] * np.eye(n_in)
    if np.linalg.cond(safe[~dead]).max(initial=1.0) > ALIKE:
        raise ValueError("the inputs cannot be told apart: drive them one at a time or with other signals")
    first = np.linalg.solve(safe.swapaxes(1, 2), G_yx.swapaxes(1, 2)).swapaxes(1, 2)
    power = np.abs(np.einsum("koo->ko", G_yy))
    with np.errstate(divide="ignore", invalid="ignore"):
        coherence = np.real(np.einsum("koi,kio->ko", first, G_xy)) / power
    if estimator == "H2":
        with np.errstate(divide="ignore", invalid="ignore"):
            second = power / G_xy[:, 0, :]
        first = np.where(np.isfinite(second), second, first[:, :, 0])[:, :, None]
    if estimator == "Hv":
        first = _total_least_squares(G, n_in)
    return np.where(dead[:, None, None], 0.0, first), np.where(dead[:, None], np.nan, coherence)


def _by_instrument(G: Complex, n_in: int, end: int) -> tuple[Complex, Array]:
    """Return Hc, (k, n_out, n_in), and the coherence of the outputs with the instruments, (k, n_out)."""
    x, y, r = slice(0, n_in), slice(n_in, end), slice(end, None)
    level = np.abs(np.einsum("krr->kr", G[:, r, r])).min(axis=1)
    dead = level <= NOTHING * level.max()
    fill = np.where(dead, 1.0, 0.0)[:, None, None] * np.eye(n_in)
    G_rr, G_xr = (np.where(dead[:, None, None], 0.0, part) + fill for part in (G[:, r, r], G[:, x, r]))
    if max(np.linalg.cond(G_rr).max(), np.linalg.cond(G_xr).max()) > ALIKE:
        raise ValueError("the inputs cannot be told apart: drive them one at a time or with other signals")
    H = np.linalg.solve(G_xr.swapaxes(1, 2), G[:, y, r].swapaxes(1, 2)).swapaxes(1, 2)
    explained = np.einsum("kyr,kry->ky", G[:, y, r], np.linalg.solve(G_rr, G[:, r, y])).real
    power = np.abs(np.einsum("kyy->ky", G[:, y, y]))
    with np.errstate(divide="ignore", invalid="ignore"):
        coherence = explained / power
    return np.where(dead[:, None, None], 0.0, H), np.where(dead[:, None], np.nan, coherence)


def _total_least_squares(G: Complex, n_in: int) -> Complex:
    """Return Hv, (k, n_out, n_in), one output at a time."""
    rows = []
    scale = np.sqrt(np.maximum(np.abs(np.einsum("kii->ki", G)), np.finfo(float).tiny))
    for o in range(n_in, G.shape[1]):
        pick = [*range(n_in), o]
        size = scale[:, pick]
        vectors = np.linalg.eigh(G[:, pick][:, :, pick] / (size[:, :, None] * size[:, None, :]))[1]
        least = vectors[:, :, 0]  # its product with [x; y] has the least power
        tail = np.where(least[:, -1] == 0, np.finfo(float).tiny, least[:, -1])
        rows.append(-(least[:, :-1] / tail[:, None]).conj() * size[:, -1:] / size[:, :-1])
    return np.asarray(np.stack(rows, axis=1))
