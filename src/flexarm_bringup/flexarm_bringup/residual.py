"""How much an arm still shakes when its motion has ended (the metrics of seed 002, section 6).

The signal is the relative tip acceleration: what the sensor feels minus what it would feel on a rigid
arm. It is filtered over the whole record (4th-order 20 Hz Butterworth, forward and backward: no delay)
and its RMS taken in [t_end + 0.1, t_end + 2.1] s. The settling time is counted from ``t_end``, the end
of the commanded motion; it is negative when the tip was there before.
"""

from __future__ import annotations

import math

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

CUTOFF_HZ = 20.0
FILTER_ORDER = 4
WINDOW = (0.1, 2.1)  # after the end of the motion [s]
TOLERANCE = 0.5e-3  # of the tip, for settling [m]
MAX_JITTER = 1e-3  # of a sample period: more is not a uniform record


class GapError(ValueError):
    """A record does not have its samples at equal distances."""


def sample_rate(t: ArrayLike) -> float:
    """Return the rate [Hz] of a uniform record.

    Raises:
        GapError: Fewer than two samples, or their distances differ.
    """
    times = np.asarray(t, dtype=float)
    steps = np.diff(times)
    if steps.size == 0 or np.ptp(steps) > MAX_JITTER * abs(steps.mean()) or steps.mean() <= 0.0:
        raise GapError("the record must have samples at equal distances")
    return float(steps.size / (times[-1] - times[0]))


def lowpass(signal: ArrayLike, rate_hz: float) -> Array:
    """Return the signal (k,) without what is above 20 Hz and without delay.

    Raises:
        ValueError: The rate is not above 40 Hz, or the record is too short to filter.
    """
    if rate_hz <= 2.0 * CUTOFF_HZ:
        raise ValueError(f"a record of {rate_hz:g} Hz cannot be filtered at {CUTOFF_HZ:g} Hz")
    sections = scipy.signal.butter(FILTER_ORDER, CUTOFF_HZ, fs=rate_hz, output="sos")
    return np.asarray(scipy.signal.sosfiltfilt(sections, np.asarray(signal, dtype=float)))


def rms(signal: ArrayLike) -> float:
    """Return the root of the mean square."""
    return float(np.sqrt(np.mean(np.square(signal))))


def residual_rms(t: ArrayLike, relative: ArrayLike, t_end: float) -> float:
    """Return the RMS [m/s^2] of the filtered relative acceleration after the motion.

    Args:
        t: Times of a uniform record [s], (k,).
        relative: Relative tip acceleration [m/s^2], (k,).
        t_end: End of the commanded motion [s].

    Raises:
        ValueError: The record is not uniform, or ends before the window does.
    """
    times = np.asarray(t, dtype=float)
    rate_hz = sample_rate(times)
    begin, end = t_end + WINDOW[0], t_end + WINDOW[1]
    slack = 0.5 / rate_hz
    if times[0] > begin + slack or times[-1] < end - slack:
        raise ValueError(f"the record [{times[0]:g}, {times[-1]:g}] s does not cover [{begin:g}, {end:g}] s")
    inside = (times >= begin - slack) & (times <= end + slack)
    return rms(lowpass(relative, rate_hz)[inside])


def decibels(value: float, reference: float) -> float:
    """Return ``20 log10(value / reference)`` [dB]; -inf for 0."""
    return 20.0 * math.log10(value / reference) if value > 0.0 else -math.inf


def settling_time(t: ArrayLike, error: ArrayLike, t_end: float, tolerance: float = TOLERANCE) -> float:
    """Return when the tip is at its goal for good, counted from the end of the motion [s].

    Between the last sample outside and the first inside, the crossing is interpolated.

    Args:
        t: Times [s], (k,).
        error: Distance of the tip from its goal, signed or not [m], (k,).
        t_end: End of the commanded motion [s].
        tolerance: What counts as there [m].

    Returns:
        Infinity when the record ends outside.
    """
    times, distance = np.asarray(t, dtype=float), np.abs(np.asarray(error, dtype=float))
    outside = np.flatnonzero(~(distance <= tolerance))  # NaN is outside
    if outside.size == 0:
        return float(times[0] - t_end)
    last = int(outside[-1])
    if last == times.size - 1:
        return math.inf
    if not np.isfinite(distance[last]):
        return float(times[last + 1] - t_end)
    share = (distance[last] - tolerance) / (distance[last] - distance[last + 1])
    return float(times[last] + share * (times[last + 1] - times[last]) - t_end)
