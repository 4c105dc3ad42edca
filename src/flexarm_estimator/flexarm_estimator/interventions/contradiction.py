"""States that a user shall not set: one that a sound encoder denies now, one that bends the arm to pieces.

A controller follows what it is told. Told that an axis is elsewhere, and sure of it, it drives the axis there
until the filter has found out.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.filter import Belief
from flexarm_estimator.state.sensors import LinearRows
from flexarm_model.manipulator.sensor_kinds import SENSOR_KINDS

Array = NDArray[np.float64]
AGREES = 5.0  # sigmas of both
MOST_BENT = 100.0  # sigmas at the start; a mode is never bent so far


def contradiction(estimator: Estimator, belief: Belief) -> str:
    """Return the field of a state that cannot be set, and why; empty where it can.

    Args:
        estimator: Whose state it is to be.
        belief: The state.
    """
    return _denied(estimator, belief) or _too_bent(estimator, belief)


def _denied(estimator: Estimator, belief: Belief) -> str:
    """Compare with what was told last: what has been asked for since knows no more of where the axes are."""
    if estimator.told is None:
        return ""
    (told, before), parts = estimator.told, estimator.past[0]
    sound = {r.name for r in told.sensors if r.status == "ok" and r.accepted}
    for spec in estimator.specs:
        if spec.kind != "encoder" or spec.name not in sound or estimator.health.is_off(spec.name):
            continue
        rows = parts.sensors.rows[spec.name]
        said, doubt = _reads(before.sensors.rows[spec.name], told.x, told.P)
        wanted, more_doubt = _reads(rows, belief.x, belief.P)
        sigma = math.sqrt(doubt + more_doubt + float(rows.R[0, 0]))
        if not abs(said - wanted) <= AGREES * sigma:
            unit = SENSOR_KINDS[spec.kind].units(spec.site)[spec.channels[0]]
            return (
                f"theta: {spec.site} would be at {wanted:.6g} {unit}, its encoder '{spec.name}' has it at "
                f"{said:.6g}; allowed: within {AGREES * sigma:.3g} {unit} of that, more with a larger "
                "theta_sigma, or with this encoder switched off"
            )
    return ""


def _reads(rows: LinearRows, x: Array, P: Array) -> tuple[float, float]:
    """Return what an encoder reads at a state (n_x,) with covariance, and the variance of that."""
    C = rows.C[0]
    return float(C @ x) + float(rows.D[0, -1]), float(C @ P @ C)


def _too_bent(estimator: Estimator, belief: Belief) -> str:
    parts = estimator.past[0]
    place = parts.layout.eta
    most = MOST_BENT * np.sqrt(parts.process.P0.diagonal()[place])
    for mode, (eta, allowed) in enumerate(zip(belief.x[place], most, strict=True), start=1):
        if not abs(eta) <= allowed:
            return f"eta: mode {mode} at {eta:.6g} kg^0.5 m; allowed: up to {allowed:.3g}"
    return ""
