"""What ``nu' S^-1 nu`` of a sample may be."""

from __future__ import annotations

from scipy.special import chdtri, ndtr

_AGREED = 5.0  # sigmas: within them sensor and state agree, however wide the gate is for the model's sake


def chi_square_bound(m: int, sigmas: float) -> float:
    """Return what is as improbable for ``m`` squares as so many sigmas are for one."""
    return float(chdtri(m, 2.0 * ndtr(-sigmas)))


def agreement_bound(m: int, gate: float) -> float:
    """Return up to which a sensor of ``m`` channels that is not used agrees with those that are.

    Args:
        m: Channels.
        gate: Of the estimator [sigma].
    """
    return chi_square_bound(m, min(gate, _AGREED))
