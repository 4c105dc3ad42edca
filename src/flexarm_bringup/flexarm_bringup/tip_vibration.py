"""What is left of the tip's vibration when a move has ended, in any direction, of any arm.

Acceleration: the tip's true position, differentiated twice and low-passed above the modes that count
(4th-order Butterworth, forward and backward); RMS of its length over a window after the move. Distance: RMS
over the same window of how far the tip is from where it settles, its mean over the last fifth of the window.
It has settled when it stays within a tolerance of that point. All of it looks at the truth.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_bringup.residual import MAX_JITTER, rms, sample_rate, settling_time

Array = NDArray[np.float64]
ORDER = 4  # of the low-pass
NYQUIST_SHARE = 0.9  # highest cutoff, of half the sample rate
LAST_PART = 0.2  # of the window, in which the tip has settled if it ever does


@dataclass(frozen=True)
class Watch:
    """When and how a move is judged.

    Attributes:
        begin, end: Window after the end of the move [s].
        cutoff_hz: Vibration faster than this is not counted [Hz].
        tolerance: Distance of the tip from where it settles that counts as settled [m].
    """

    begin: float
    end: float
    cutoff_hz: float
    tolerance: float


@dataclass(frozen=True)
class Residual:
    """What is left after a move.

    Attributes:
        acceleration: RMS of the tip's acceleration [m/s^2].
        distance: RMS of its distance from where it settles [m].
        settling: From the end of the motion until the tip stays within the tolerance [s]; below zero before
            it, at minus its duration when the tip does not leave the tolerance at all.
        growth: RMS of the acceleration in the second half of the window over that in the first.
    """

    acceleration: float
    distance: float
    settling: float
    growth: float


def read_residual(t: Array, tip: Array, t_start: float, t_end: float, watch: Watch) -> Residual:
    """Read what is left of the vibration.

    Args:
        t: Times of a uniform record [s], (k,).
        tip: True position of the tip [m], (k, 3).
        t_start: Begin of the motion [s].
        t_end: Its end [s].
        watch: When and how to look.

    Raises:
        ValueError: The record is not uniform or too short; the window may end a period after its last tick,
            as that of a run does that is watched to its end.
    """
    rate_hz = sample_rate(t)
    slack = 0.5 / rate_hz
    if t[-1] + (1.0 + MAX_JITTER) / rate_hz < t_end + watch.end - slack:
        raise ValueError(f"the record ends at {t[-1]:g} s, before the window does")
    until = t <= t_end + watch.end + slack
    inside = until & (t >= t_end + watch.begin - slack)
    left = np.linalg.norm(tip_acceleration(tip, rate_hz, watch.cutoff_hz)[inside], axis=1)
    rest = tip[inside][-max(int(LAST_PART * left.size), 1) :].mean(axis=0)
    error = np.linalg.norm(tip - rest, axis=1)
    half = left.size // 2
    return Residual(
        rms(left),
        rms(error[inside]),
        max(settling_time(t[until], error[until], t_end, watch.tolerance), t_start - t_end),
        rms(left[half:]) / max(rms(left[:half]), float(np.finfo(float).tiny)),
    )


def tip_acceleration(tip: Array, rate_hz: float, cutoff_hz: float) -> Array:
    """Return the low-passed acceleration of the tip without delay [m/s^2], (k, 3).

    Args:
        tip: Position [m], (k, 3).
        rate_hz: Samples per second [Hz].
        cutoff_hz: Faster vibration is not counted [Hz].
    """
    raw = np.zeros_like(tip)
    raw[1:-1] = np.diff(tip, n=2, axis=0) * rate_hz**2
    return without_fast(raw, rate_hz, cutoff_hz)


def without_fast(signal: Array, rate_hz: float, cutoff_hz: float) -> Array:
    """Return a low-passed signal without delay, (k, c).

    Args:
        signal: At equal distances of time, (k, c).
        rate_hz: Samples per second [Hz].
        cutoff_hz: Of the low-pass; lowered to what the rate allows [Hz].
    """
    cutoff = min(cutoff_hz, NYQUIST_SHARE * rate_hz / 2)
    sections = scipy.signal.butter(ORDER, cutoff, fs=rate_hz, output="sos")
    return np.asarray(scipy.signal.sosfiltfilt(sections, signal, axis=0))
