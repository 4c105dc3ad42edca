"""Rule for the filter: what it must bear of the modes is what the measurement leaves open of them.

Its relative error of frequency becomes three sigma of what is not known: the uncertainty of the parameters
carried over to the frequencies, and what the fit leaves. It never grows, as the setting before may have been
chosen with payloads in mind that no test shows, and never falls below what a model leaves out anyway.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.identification.model_update import Update

SIGMAS = 3.0
LEAST = 0.005  # relative: temperature, clamping, amplitude


def frequency_doubt(update: Update) -> float:
    """Return one sigma of the updated frequencies, relative [1]."""
    covariance = update.correlation * np.outer(update.sigma, update.sigma)
    told = np.flatnonzero(update.identified)
    S = update.sensitivity[:, told]
    carried = np.einsum("ij,jk,ik->i", S, covariance[np.ix_(told, told)], S)
    left = float(np.sqrt(np.mean(update.after**2))) if update.after.size else 0.0
    return float(np.hypot(np.sqrt(max(carried.max(initial=0.0), 0.0)), left))


def fit_noise(settings: EstimatorConfig, doubt: float) -> EstimatorConfig:
    """Return the settings of the filter; ``doubt`` is one sigma of the frequencies, relative [1]."""
    wanted = max(SIGMAS * doubt, LEAST)
    return replace(settings, frequency_error=min(settings.frequency_error, wanted))
