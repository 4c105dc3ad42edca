"""Modes that the lines cannot part from stronger ones beside them.

Less than half a line apart, poles can be parted by a second input alone, where it drives them differently. A
window spreads every resonance over its main lobe, which no single pole follows: two or three fit it better
than one, all of one shape. So within the main lobe a mode counts where its residues are its own, not where
they are what the stronger ones beside it explain.
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_model.identification.stabilisation import likeness
from flexarm_model.modal.fit import PoleFit

Complex = NDArray[np.complex128]
ALIKE = 0.9  # assurance criterion from which two participations are the same; share that others explain [1]
HALF_A_LINE = 0.5  # by which a mode in the middle between two lines is off both [lines]
SAMPLES, FINER = 256, 64  # of a window that is looked at; points per line


def doubles(
    fit: PoleFit, participation: Complex, spacing_hz: float, lobe_lines: float = 0.0
) -> NDArray[np.bool_]:
    """Tell which modes are doubles of stronger ones, (r,).

    Args:
        fit: The modes.
        participation: Of the inputs, (r, n_in).
        spacing_hz: Distance of the lines [Hz].
        lobe_lines: Width of the main lobe of the window [lines]; 0 where there was none.
    """
    model = fit.model
    residues = model.residues.reshape(model.poles.size, -1)
    size = np.linalg.norm(residues, axis=1)
    found = np.zeros(model.poles.size, bool)
    for i in range(model.poles.size):
        apart = abs(model.f_hz - model.f_hz[i]) / spacing_hz
        stronger = (size >= size[i]) & (np.arange(size.size) != i)
        near = np.flatnonzero(stronger & (apart < HALF_A_LINE))
        found[i] = any(likeness(participation[i], participation[j]) > ALIKE for j in near)
        if lobe_lines:
            beside = residues[stronger & (apart < lobe_lines)]
            found[i] |= _explained(residues[i], beside) > ALIKE
    return found


def main_lobe(window: str) -> float:
    """Return the width of a window's main lobe, between its first minima [lines]; 4 for "hann".

    Args:
        window: Name of a window of scipy.signal.
    """
    size = abs(np.fft.rfft(scipy.signal.get_window(window, SAMPLES), SAMPLES * FINER))
    flank = int(np.argmax(size < size.max() / 2))  # past the ripple of a flat top
    return 2 * (flank + float(np.argmax(np.diff(size[flank:]) > 0.0))) / FINER


def _explained(vector: Complex, others: Complex) -> float:
    """Return the share of the power of a vector, (n,), that lies in the span of others, (m, n) [1]."""
    if not len(others):
        return 0.0
    basis = np.linalg.svd(others, full_matrices=False)[2]
    return float(np.linalg.norm(basis.conj() @ vector) ** 2 / np.linalg.norm(vector) ** 2)
