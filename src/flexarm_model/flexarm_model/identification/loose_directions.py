"""Combinations of fitted parameters that the data do not tell: directions as wide as the prior."""

from __future__ import annotations

import numpy as np

from flexarm_model.identification.model_update import IDENTIFIED, Update


def loose_directions(update: Update) -> list[str]:
    """Return, in words, combinations of parameters that the data do not tell."""
    spread = np.array([unknown.spread for unknown in update.unknowns])
    covariance = update.correlation * np.outer(update.sigma / spread, update.sigma / spread)
    values, vectors = np.linalg.eigh(covariance)
    lines = []
    for value, vector in zip(values, vectors.T, strict=True):
        parts = [
            f"{weight:+.2f} {unknown.name}"
            for weight, unknown in zip(vector, update.unknowns, strict=True)
            if abs(weight) > 0.1
        ]
        if value > IDENTIFIED**2 and len(parts) > 1:
            lines.append(f"only their combination is known, not {' '.join(parts)}")
    return lines
