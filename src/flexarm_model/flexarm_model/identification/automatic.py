"""Modes from frequency responses without anybody choosing an order.

The poles that last through the stabilisation chart are refined by modal least squares with common poles.
What the data do not hold is then left out, one mode at a time, the weakest first: a mode that ran to a
bound, that is the double of another one (``doubles``), whose frequency is not known to half its bandwidth, or
that stands out of the noise by less than chance does.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_model.identification.doubles import doubles
from flexarm_model.identification.lscf import OrderPoles, poles_of_orders
from flexarm_model.identification.stabilisation import Track, lasting
from flexarm_model.modal.fit import FitOptions, PoleFit, fit_poles
from flexarm_model.modal.frf import Frf
from flexarm_model.modal.partial_fractions import REMAINDERS

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
LINES_PER_ORDER = 3  # lines for every order of the chart, so that noise cannot make a track of its own
MOST_POLES = 80  # of the highest order, all inputs together; its eigenvalues take most of the time
STANDS_OUT = 4.0  # standard deviations of a mode's frequency per bandwidth, and of its size
ROUNDING = 1e-12  # of a response's size: what is left of one without noise is rounding, not noise
LARGEST_DAMPING = 0.15  # beyond it a pole is a slope, not a resonance [1]


@dataclass(frozen=True)
class Identified:
    """Modes of a band, and how they were found.

    Attributes:
        fit: Refined poles with uncertainty, residues and remainders; None when there is no mode.
        chart: Poles of every order.
        chosen: Tracks that the refinement started from.
        dropped_hz: Frequencies that lasted through the orders and were left out again [Hz].
    """

    fit: PoleFit | None
    chart: tuple[OrderPoles, ...]
    chosen: tuple[Track, ...]
    dropped_hz: tuple[float, ...]


def identify_modes(
    frf: Frf,
    weight: Array | None = None,
    remainders: tuple[int, ...] = REMAINDERS,
    lobe_lines: float = 0.0,
    say: Callable[[str], None] = lambda text: None,
) -> Identified:
    """Return the modes in the band of ``frf``.

    Args:
        frf: Responses, evenly spaced lines; the smaller side should be the inputs (``transposed``).
        weight: Of every line, (k,), or of every line and output, (k, n_out); 0 masks, None weighs all alike.
        remainders: Powers of j w for the modes out of band.
        lobe_lines: Width of the main lobe of the window behind which the responses were measured [lines]; 0
            for none.
        say: Is told how many poles are being fitted: with many inputs and outputs that takes its time.

    Raises:
        ValueError: The lines are not evenly spaced or too few.
    """
    chart = poles_of_orders(frf, orders_for(frf), weight)
    chosen = tuple(track for track in lasting(chart) if -track.pole.real < LARGEST_DAMPING * abs(track.pole))
    options = FitOptions(weight=weight, remainders=remainders)
    start = Identified(None, chart, chosen, ())
    poles = np.array([track.pole for track in chosen])
    participation = np.array([track.participation for track in chosen]).reshape(len(chosen), frf.H.shape[2])
    return _refined(frf, start, (poles, participation), options, lobe_lines, say)


def without_mode(
    frf: Frf, found: Identified, left_out: int, options: FitOptions, lobe_lines: float = 0.0
) -> Identified:
    """Return the modes found without one of them, the others fitted again.

    Args:
        frf: Responses that were fitted.
        found: Modes of them.
        left_out: Index of the mode.
        options: With which they were fitted.
        lobe_lines: See ``identify_modes``.
    """
    if found.fit is None:
        return found
    rest = np.delete(found.fit.model.poles, left_out), np.delete(driven(found.fit), left_out, axis=0)
    return _refined(frf, found, rest, options, lobe_lines)


def _refined(
    frf: Frf,
    found: Identified,
    start: tuple[Complex, Complex],
    options: FitOptions,
    lobe_lines: float,
    say: Callable[[str], None] = lambda text: None,
) -> Identified:
    """Return the modes that the data hold, from poles (r,) and participations (r, n_in)."""
    (poles, participation), dropped = start, list(found.dropped_hz)
    while poles.size:
        say(f"fitting modes: {poles.size} poles, {frf.H.shape[1]} x {frf.H.shape[2]} responses")
        fit = fit_poles(frf, poles, participation, options)
        doubt = _doubt(fit, frf, options.weight)
        doubt[doubles(fit, driven(fit), float(frf.f_hz[1] - frf.f_hz[0]), lobe_lines)] = np.inf
        if doubt.max() < 1.0:
            return replace(found, fit=fit, dropped_hz=tuple(dropped))
        worst = int(doubt.argmax())
        dropped.append(float(fit.model.f_hz[worst]))
        poles = np.delete(fit.model.poles, worst)
        participation = np.delete(driven(fit), worst, axis=0)
    return replace(found, fit=None, dropped_hz=tuple(dropped))


def orders_for(frf: Frf) -> range:
    """Return the orders of the chart that the lines allow."""
    most = min(MOST_POLES // frf.H.shape[2], len(frf.f_hz) // LINES_PER_ORDER)
    return range(2, max(most, 2) + 1)


def driven(fit: PoleFit) -> Complex:
    """Return the participations of the inputs, (r, n_in)."""
    return np.asarray(np.linalg.svd(fit.model.residues)[2][:, 0, :])


def _doubt(fit: PoleFit, frf: Frf, weight: Array | None) -> Array:
    """Return how doubtful every mode is, (r,); from 1 on it is none."""
    bandwidth = 2 * fit.model.zeta * fit.model.f_hz
    unknown = STANDS_OUT * np.nan_to_num(fit.f_std_hz, nan=0.0) / bandwidth
    faint = STANDS_OUT / np.maximum(_prominence(fit, frf, weight), 1e-12)
    overdamped = fit.model.zeta / LARGEST_DAMPING
    return np.where(fit.at_bound, np.inf, np.maximum(np.maximum(unknown, faint), overdamped))


def _prominence(fit: PoleFit, frf: Frf, weight: Array | None) -> Array:
    """Return the size of every mode over what the noise alone would give it, (r,)."""
    counts = np.ones((frf.f_hz.size, 1)) if weight is None else weight.reshape(frf.f_hz.size, -1)
    noise, size = (
        np.sqrt((abs(H) ** 2 * counts[:, :, None]).sum(axis=0) / np.maximum(counts.sum(axis=0), 1.0)[:, None])
        for H in (frf.H - fit.model.frf(frf.f_hz).H, frf.H)
    )  # (n_out, n_in) each
    noise = np.maximum(noise, np.maximum(ROUNDING * size, np.finfo(float).tiny))
    shape = abs(frf.s) ** frf.power
    values = []
    for pole, residue in zip(fit.model.poles, fit.model.residues, strict=True):
        curve = shape / abs(frf.s - pole)  # of a residue of one
        values.append(np.sqrt(np.sum((abs(residue) / noise) ** 2) * np.sum(curve**2)))
    return np.asarray(np.array(values) / np.sqrt(frf.H[0].size))
