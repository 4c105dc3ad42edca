"""60 s of eight channels at 2 kHz to modes: responses, mode indicator, automatic fit; CPU time of one thread.

One force and seven accelerometers on a structure of eight modes from 20 to 700 Hz, white noise as excitation,
1 % of noise on every sensor. Making the record is not timed.
"""

from __future__ import annotations

import time

import numpy as np
from scipy.signal import cont2discrete, lfilter

from flexarm_model.identification.automatic import identify_modes
from flexarm_model.identification.spectra import SpectrumSettings, measure_frf
from flexarm_model.modal.cmif import cmif, pick_modes, track_curves

SECONDS, RATE, OUTPUTS = 60.0, 2000.0, 7
F_HZ = np.array([23.0, 61.0, 64.5, 118.0, 203.0, 311.0, 442.0, 655.0])
ZETA, NOISE = 0.01, 0.01
RESOLUTION, BAND = 0.5, (10.0, 780.0)  # Hz


def record(seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Return a force, (n, 1), and accelerations, (n, OUTPUTS)."""
    rng = np.random.default_rng(0)
    x = rng.standard_normal(round(seconds * RATE))
    shapes = rng.standard_normal((F_HZ.size, OUTPUTS)) + 0.5
    y = np.zeros((x.size, OUTPUTS))
    for f_hz, shape in zip(F_HZ, shapes, strict=True):
        omega = 2 * np.pi * f_hz
        system = ([1.0, 0.0, 0.0], [1.0, 2 * ZETA * omega, omega**2])
        b, a, _ = cont2discrete(system, 1 / RATE, method="zoh")
        y += np.outer(lfilter(np.ravel(b), a, x), shape)
    y += NOISE * y.std(axis=0) * rng.standard_normal(y.shape)
    return x[:, None], y


def main(seconds: float = SECONDS) -> dict[str, float]:
    """Identify; return CPU times [s] and what was found."""
    x, y = record(seconds)
    started = time.thread_time()
    measured = measure_frf([x], [y], RATE, SpectrumSettings(round(RATE / RESOLUTION)), "accelerance")
    responses = time.thread_time()
    frf = measured.frf.band(*BAND)
    peaks = pick_modes(track_curves(cmif(frf)))
    indicator = time.thread_time()
    fit = identify_modes(frf).fit
    ended = time.thread_time()
    found = np.array([]) if fit is None else fit.model.f_hz
    near = [abs(found - f).min() / f if found.size else 1.0 for f in F_HZ]
    return {
        "identify_responses_s": responses - started,
        "identify_indicator_s": indicator - responses,
        "identify_fit_s": ended - indicator,
        "identify_60_s_of_8_channels_s": ended - started,
        "indicator_peaks": float(len(peaks)),
        "modes_found": float(np.sum(np.array(near) < 0.005)),
        "modes_put_in": float(F_HZ.size),
        "modes_invented": float(max(0, found.size - F_HZ.size)),
        "worst_frequency_error": float(max(near)),
    }
