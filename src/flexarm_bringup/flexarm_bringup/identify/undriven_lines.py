"""Lines that several hits in one record leave without input: with one every T seconds, those between 1/T.

A line counts where every input has a share of the power that it has on the loudest line near by.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_bringup.identify.sweeps import DRIVEN
from flexarm_model.identification.spectra import BlockSpectra, MeasuredFrf


def undriven_lines(blocks: BlockSpectra, reach: int) -> NDArray[np.bool_]:
    """Return the lines on which some input has hardly any power, (k,).

    Args:
        blocks: Spectra of the inputs, and of more.
        reach: Lines to either side among which the loudest is looked for; 0 finds none.
    """
    power = np.sum(abs(blocks.spectra[:, :, : blocks.n_in]) ** 2, axis=0)  # (k, n_in)
    loudest = scipy.ndimage.maximum_filter1d(power, 2 * reach + 1, axis=0)
    return np.asarray((power < DRIVEN * loudest).any(axis=1))


def without_lines(measured: MeasuredFrf, undriven: NDArray[np.bool_]) -> MeasuredFrf:
    """Return responses of which some lines have no coherence and so do not count, (k,)."""
    return replace(measured, coherence=np.where(undriven[:, None], np.nan, measured.coherence))
