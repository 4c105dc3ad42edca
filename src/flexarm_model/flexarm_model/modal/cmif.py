"""Complex mode indicator function: the singular values of the FRF matrix over frequency.

    H(w) = U(w) S(w) V(w)^H

A peak of a curve is a mode; at a peak the left vector is near the mode's shape at the outputs and the
conjugate right vector near its participation of the inputs. As many modes as there are inputs
(or outputs) can hide under one frequency: they show in different curves [Shih1988].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_model.modal.frf import Frf
from flexarm_model.modal.peaks import Peak, pick_peaks
from flexarm_model.modal.read_only import lock_arrays

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Cmif:
    """All curves, m = min(n_out, n_in).

    Attributes:
        f_hz: Lines [Hz], (k,).
        values: Singular values, in the unit of H, (k, m).
        left: Columns are shapes at the outputs, (k, n_out, m).
        right: Columns are participations of the inputs, conj(V), (k, n_in, m).
        power: Power of j w over a receptance.
    """

    f_hz: Array
    values: Array
    left: Complex
    right: Complex
    power: int

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        lock_arrays(self)

    def db(self, reference: float = 1.0) -> Array:
        """Return the curves in dB of ``reference``, (k, m)."""
        with np.errstate(divide="ignore"):
            return np.asarray(20 * np.log10(self.values / reference))


@dataclass(frozen=True)
class CmifPeak:
    """A peak of one curve.

    Attributes:
        curve: Number of the curve, 0 is the highest (or the tracked one's).
        peak: Where and how high.
        shape: At the outputs, unit length, (n_out,).
        participation: At the inputs, unit length, (n_in,).
    """

    curve: int
    peak: Peak
    shape: Complex
    participation: Complex

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        lock_arrays(self)


def cmif(frf: Frf) -> Cmif:
    """Return all singular-value curves, sorted at every line."""
    left, values, right = np.linalg.svd(frf.H, full_matrices=False)
    return Cmif(frf.f_hz, values, left, right.transpose(0, 2, 1), frf.power)


def track_curves(curves: Cmif) -> Cmif:
    """Return the curves continued through their crossings.

    Sorted curves exchange their vectors where they cross, which makes a peak of the lower one where no
    mode is. From line to line the continuation keeps the sum of |u' u| |v' v| largest.
    """
    values, left, right = curves.values.copy(), curves.left.copy(), curves.right.copy()
    for i in range(1, len(values)):
        alike = abs(left[i - 1].conj().T @ left[i]) * abs(right[i - 1].conj().T @ right[i])  # (m, m)
        order = scipy.optimize.linear_sum_assignment(alike, maximize=True)[1]
        values[i], left[i], right[i] = values[i, order], left[i][:, order], right[i][:, order]
    return Cmif(curves.f_hz, values, left, right, curves.power)


def pick_modes(curves: Cmif, prominence_db: float = 3.0, lowest_hz: float = 0.0) -> tuple[CmifPeak, ...]:
    """Return the peaks of all curves, slowest first.

    Args:
        curves: From ``cmif``, better from ``track_curves``.
        prominence_db: Smallest prominence.
        lowest_hz: Lines below are left out (accelerometers see nothing but noise there).
    """
    found = [
        CmifPeak(number, peak, curves.left[peak.line, :, number], curves.right[peak.line, :, number])
        for number in range(curves.values.shape[1])
        for peak in pick_peaks(curves.f_hz, curves.values[:, number], curves.power, prominence_db)
        if peak.line_hz >= lowest_hz
    ]
    return tuple(sorted(found, key=lambda item: item.peak.f_hz))
