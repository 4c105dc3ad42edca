"""Half of a record predicts the other half: poles and shapes of the first, driven by the measured input.

Every pole is simulated over the whole record, ``x' = p x + u``, exactly for an input that is held and else
for one that goes straight from sample to sample. With ``s^2 R / (s - p) = R p^2 / (s - p) + R (s + p)``
displacement, velocity and acceleration alike are real combinations of ``Re x``, ``Im x``, the input, its
integrals and what is left of the state before the record, ``e^{p t}``. The combination is fitted to the
first half and left alone in the second, where the fit is judged::

    fit = 100 (1 - |y - y_hat| / |y - mean y|)

Signals and regressors are filtered to the band alike, so drift below the modes does not count. Refused are
models with a pole that does not decay, and overfitted ones: in the second half they leave clearly more than
in the first, or predict less than nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
ORDER = 4  # of the band filter
WORSE, SLACK = 1.5, 5.0  # what may be left in the second half: so much more than in the first, and points
EDGE = 0.9  # of half the sample rate: highest end of a band
LOST = 1e-12  # of the largest column: rounding
MOST_COLUMNS = 1 / 4  # of the samples; more regressors fit anything


@dataclass(frozen=True)
class HalfFit:
    """What the first half of a record says of the second.

    Attributes:
        first: Fit of every output in the half it was fitted to [%], (n_out,).
        second: The same in the other half, predicted [%], (n_out,).
        refusal: Why the model must not be used; empty when it may.
    """

    first: Array
    second: Array
    refusal: str


@dataclass(frozen=True)
class Halved:
    """A record to be halved.

    Attributes:
        u: Inputs, (n, n_in).
        y: Outputs, (n, n_out).
        dt: Sample period [s].
        is_held: An input stays until the next sample.
        band_hz: Band in which outputs are compared [Hz].
    """

    u: Array
    y: Array
    dt: float
    is_held: bool
    band_hz: tuple[float, float]


def predict_half(poles: Complex, records: Sequence[Halved]) -> HalfFit:
    """Return how well poles that were identified in the first halves predict the second ones.

    Args:
        poles: In the upper half plane [rad/s], (r,).
        records: With the same inputs and outputs.
    """
    growing = [abs(pole) / (2 * np.pi) for pole in poles if pole.real >= 0.0]
    n_out = records[0].y.shape[1]
    if growing or not poles.size:
        text = f"unstable: the mode at {growing[0]:.4g} Hz does not decay" if growing else "there is no mode"
        return HalfFit(np.full(n_out, np.nan), np.full(n_out, np.nan), text)
    sides: tuple[list[Array], list[Array]] = ([], [])
    for record in records:
        X, y = _scaled(_filtered(_regressors(poles, record), record)), _filtered(record.y, record)
        middle = record.y.shape[0] // 2
        if X.shape[1] > MOST_COLUMNS * middle:
            nothing = np.full(n_out, np.nan)
            return HalfFit(nothing, nothing, f"overfitted: {X.shape[1]} terms for {middle} samples")
        C = np.linalg.lstsq(X[:middle], y[:middle], rcond=None)[0]
        for side, part in zip(sides, (slice(None, middle), slice(middle, None)), strict=True):
            side.append(np.array([y[part] - X[part] @ C, y[part]]))
    first, second = (_fit(np.concatenate(side, axis=1)) for side in sides)
    return HalfFit(first, second, _overfitted(first, second))


def _fit(pairs: Array) -> Array:
    """Return the fit [%] of residual and signal, (2, k, n_out) -> (n_out,)."""
    left, signal = pairs
    size = np.linalg.norm(signal - signal.mean(axis=0), axis=0)
    return np.asarray(100.0 * (1.0 - np.linalg.norm(left, axis=0) / np.maximum(size, np.finfo(float).tiny)))


def _overfitted(first: Array, second: Array) -> str:
    """Return which output tells that the model fits noise; empty when none does."""
    most = WORSE * (100.0 - first) + SLACK
    for k in np.flatnonzero(100.0 - second > np.minimum(most, 100.0)):
        return (
            f"overfitted: output {k + 1} is fitted to {first[k]:.1f} % in the first half and predicted to "
            f"{second[k]:.1f} % in the second; {100.0 - min(most[k], 100.0):.1f} % is wanted"
        )
    return ""


def _regressors(poles: Complex, record: Halved) -> Array:
    """Return the simulated states, inputs, their integrals and free decays, (n, columns)."""
    n, dt = record.u.shape[0], record.dt
    t = np.arange(n) * dt
    columns = [np.ones(n), t]
    for u in record.u.T:
        once = np.cumsum(u) * dt
        columns += [u, once, np.cumsum(once) * dt]
        for pole in poles:
            x = _simulate(complex(pole), u, dt, record.is_held)
            columns += [x.real, x.imag]
    for pole in poles:
        decay = np.exp(pole * t)
        columns += [decay.real, decay.imag]
    return np.stack(columns, axis=1)


def _simulate(pole: complex, u: Array, dt: float, is_held: bool) -> Complex:
    """Return ``x' = p x + u`` from rest, (n,)."""
    z = pole * dt
    a = np.exp(z)
    held = (a - 1.0) / pole
    if is_held:
        return np.asarray(scipy.signal.lfilter([0.0, held], [1.0, -a], u.astype(complex)))
    slope = (a - 1.0 - z) / (pole * z)  # share of the sample at the end of a period
    return np.asarray(scipy.signal.lfilter([slope, held - slope], [1.0, -a], u.astype(complex)))


def _filtered(signals: Array, record: Halved) -> Array:
    nyquist = 0.5 / record.dt
    low, high = record.band_hz[0] / nyquist, min(record.band_hz[1] / nyquist, EDGE)
    sections = scipy.signal.butter(ORDER, [low, high], "bandpass", output="sos")
    return np.asarray(scipy.signal.sosfiltfilt(sections, signals, axis=0))


def _scaled(X: Array) -> Array:
    """Return the columns that are not lost in the band filter, of length one each, (n, k)."""
    size = np.linalg.norm(X, axis=0)
    kept = size > LOST * size.max()
    return np.asarray(X[:, kept] / size[kept])
