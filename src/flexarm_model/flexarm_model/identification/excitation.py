"""Signals that excite an arm over a band, with peak 1; each is repeated, so that no block leaks.

    multisine  sum of cosines on every line of the band with low crest factor: the phases of Schroeder
               ``phi_k = -pi k (k - 1) / K`` [Schroeder1970], then clipped and put back on its lines again
               and again [VanDerOuderaa1988]
    chirp      ``sin 2 pi (f_low t + (f_high - f_low) t^2 / 2 T)``, a whole number of cycles
    prbs       pseudo-random steps of a shift register of greatest length, by nature of crest factor 1
    impulse    one half sine, whose spectrum falls to a fifth at the end of the band

The crest factor is ``max |x| / rms x``: the smaller, the more energy for the same peak torque.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_model.modal.read_only import lock_arrays

Array = NDArray[np.float64]
CLIPPINGS = 300  # rounds of clipping; afterwards the crest factor hardly falls
CLIP = 0.6  # share of the peak that the first round leaves; the last leaves all
STEPS_PER_CYCLE = 2.5  # of the band's upper end in a pseudo-random signal: 1.8 dB less power there
SHORTEST_REGISTER, LONGEST_REGISTER = 5, 20  # stages
HALF_SINE = 0.9  # length of the impulse in cycles of the band's upper end


@dataclass(frozen=True)
class Excitation:
    """One period of a signal.

    Attributes:
        name: A key of ``SIGNALS``.
        signal: Samples, largest magnitude 1, (n,).
        rate_hz: Samples per second [Hz].
        band_hz: Where its power is [Hz].
    """

    name: str
    signal: Array
    rate_hz: float
    band_hz: tuple[float, float]

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        lock_arrays(self)

    @property
    def period(self) -> float:
        """Length of a period [s]."""
        return self.signal.size / self.rate_hz

    @property
    def crest_factor(self) -> float:
        """Peak over root mean square [1]."""
        return crest_factor(self.signal)

    @property
    def share_in_band(self) -> float:
        """Share of the power that lies in the band [1]."""
        power = abs(np.fft.rfft(self.signal)[1:]) ** 2
        f_hz = np.fft.rfftfreq(self.signal.size, 1.0 / self.rate_hz)[1:]
        half = 0.5 * self.rate_hz / self.signal.size
        inside = (f_hz >= self.band_hz[0] - half) & (f_hz <= self.band_hz[1] + half)
        return float(power[inside].sum() / power.sum())


def excitation(name: str, band_hz: tuple[float, float], rate_hz: float, period: float) -> Excitation:
    """Return one period of a signal.

    Args:
        name: A key of ``SIGNALS``.
        band_hz: Lowest and highest frequency [Hz].
        rate_hz: Samples per second [Hz].
        period: Wanted length [s]; that of a pseudo-random signal is the nearest a register allows.

    Raises:
        ValueError: The signal is unknown, or band, rate and period do not fit each other.
    """
    if name not in SIGNALS:
        raise ValueError(f"signal '{name}' is not one of {', '.join(SIGNALS)}")
    low, high = band_hz
    n = round(period * rate_hz)
    if not (0.0 < low < high < rate_hz / 2 and low * n >= rate_hz and (high - low) * n >= rate_hz):
        raise ValueError(
            f"band {low:g} to {high:g} Hz does not fit {period:g} s at {rate_hz:g} Hz: needed are "
            f"0 < low < high < {rate_hz / 2:g} Hz, and a cycle of low and of their difference in the period"
        )
    signal = SIGNALS[name](band_hz, rate_hz, n)
    return Excitation(name, np.asarray(signal / abs(signal).max()), rate_hz, band_hz)


def crest_factor(signal: Array) -> float:
    """Return the peak over the root mean square [1]."""
    return float(abs(signal).max() / np.sqrt(np.mean(np.square(signal))))


def schroeder_multisine(band_hz: tuple[float, float], rate_hz: float, n: int) -> Array:
    """Return cosines of equal size on all lines of a band with Schroeder's phases, (n,)."""
    lines = _lines(band_hz, rate_hz, n)
    k = np.arange(1, lines.size + 1)
    return _on_lines(np.exp(-1j * np.pi * k * (k - 1) / lines.size), lines, n)


def _multisine(band_hz: tuple[float, float], rate_hz: float, n: int) -> Array:
    """Return the best signal on the way from Schroeder's phases by clipping, (n,)."""
    lines, signal = _lines(band_hz, rate_hz, n), schroeder_multisine(band_hz, rate_hz, n)
    best = signal
    for level in np.linspace(CLIP, 1.0, CLIPPINGS, endpoint=False):
        clipped = np.clip(signal, *(level * abs(signal).max() * np.array([-1.0, 1.0])))
        signal = _on_lines(np.exp(1j * np.angle(np.fft.rfft(clipped)[lines])), lines, n)
        best = min(best, signal, key=crest_factor)
    return best


def _chirp(band_hz: tuple[float, float], rate_hz: float, n: int) -> Array:
    t, period = np.arange(n) / rate_hz, n / rate_hz
    cycles = round((band_hz[0] + band_hz[1]) / 2 * period)
    slope = 2 * (cycles / period - band_hz[0]) / period
    return np.asarray(np.sin(2 * np.pi * (band_hz[0] * t + slope * t**2 / 2)))


def _prbs(band_hz: tuple[float, float], rate_hz: float, n: int) -> Array:
    hold = max(1, int(rate_hz / (STEPS_PER_CYCLE * band_hz[1])))
    stages = int(np.clip(round(np.log2(n / hold + 1)), SHORTEST_REGISTER, LONGEST_REGISTER))
    return np.repeat(2.0 * scipy.signal.max_len_seq(stages)[0] - 1.0, hold)


def _impulse(band_hz: tuple[float, float], rate_hz: float, n: int) -> Array:
    width = max(2, round(HALF_SINE * rate_hz / band_hz[1]))
    signal = np.zeros(n)
    signal[:width] = np.sin(np.pi * (np.arange(width) + 0.5) / width)
    return signal


SIGNALS: dict[str, Callable[[tuple[float, float], float, int], Array]] = {
    "multisine": _multisine,
    "chirp": _chirp,
    "prbs": _prbs,
    "impulse": _impulse,
}


def _lines(band_hz: tuple[float, float], rate_hz: float, n: int) -> NDArray[np.intp]:
    return np.arange(int(np.ceil(band_hz[0] * n / rate_hz)), int(band_hz[1] * n / rate_hz) + 1)


def _on_lines(values: NDArray[np.complex128], lines: NDArray[np.intp], n: int) -> Array:
    spectrum = np.zeros(n // 2 + 1, complex)
    spectrum[lines] = values
    return np.asarray(np.fft.irfft(spectrum, n))
