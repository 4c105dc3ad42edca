"""A reference of the axes in a file, for the commander: worked out once, sent as often as wanted.

A NumPy archive with ``t`` [s] (k,), ``theta``, ``theta_dot``, ``theta_ddot`` [rad or m, per s, per s^2]
(k, n_theta) each, and ``end``: until when the motion is watched [s].
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flexarm_controller.reference import Reference
from flexarm_model.settings.strict_yaml import ConfigError

PARTS = ("t", "theta", "theta_dot", "theta_ddot")


def save_reference(path: Path, reference: Reference, end: float) -> None:
    """Write a reference that is watched until ``end`` [s]."""
    with path.open("wb") as file:
        np.savez(file, end=np.array(end), **{part: getattr(reference, part) for part in PARTS})


def load_reference(path: Path) -> tuple[Reference, float]:
    """Return a reference and until when it is watched [s].

    Raises:
        ConfigError: The file cannot be read or lacks something.
    """
    try:
        with np.load(path, allow_pickle=False) as parts:
            return Reference(*(parts[part] for part in PARTS)), float(parts["end"])
    except (OSError, KeyError, ValueError) as error:
        raise ConfigError(f"reference: {path}: {error}") from error


def from_rest(reference: Reference) -> Reference:
    """Return the reference with its rest before the first sample written out from time zero on."""
    if reference.t[0] <= 0.0:
        return reference
    still = np.zeros((1, reference.theta.shape[1]))
    return Reference(
        np.append(0.0, reference.t),
        np.concatenate([reference.theta[:1], reference.theta]),
        np.concatenate([still, reference.theta_dot]),
        np.concatenate([still, reference.theta_ddot]),
    )
