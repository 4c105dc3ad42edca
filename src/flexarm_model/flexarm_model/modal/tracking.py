"""Modes followed over a series of poses by their shapes, through crossings and double modes.

From pose to pose the assignment with the largest sum of MAC is taken, so a mode keeps its number when
frequencies cross. Modes nearer than a tolerance are one multiple mode there: before they are compared
they are rotated onto the shapes they come from. Shapes must be in common coordinates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_model.modal.mac import align_rotation, align_signs, mac
from flexarm_model.modal.modes import Modes
from flexarm_model.modal.read_only import lock_arrays

Array = NDArray[np.float64]

MULTIPLE = 1e-4  # relative distance of frequencies below which modes are one multiple mode
UNCLEAR = 0.7  # MAC below which the next pose is too far to follow a mode


@dataclass(frozen=True)
class Tracks:
    """Modes by track; track j starts as mode j of the first pose.

    Attributes:
        order: Mode of every pose that continues the track, (n_poses, r).
        omega: Its angular frequency [rad/s], (n_poses, r).
        shapes: Its shape, signs and multiple modes aligned with the pose before, (n_poses, n, r).
        mac: MAC with the pose before, 1 at the first pose, (n_poses, r).
    """

    order: NDArray[np.intp]
    omega: Array
    shapes: Array
    mac: Array

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        lock_arrays(self)

    @property
    def unclear(self) -> NDArray[np.bool_]:
        """Where a track may be lost: a mode left the set or the poses are far apart, (n_poses, r)."""
        return self.mac < UNCLEAR


def track_modes(
    series: Sequence[Modes], weights: Sequence[Array] | None = None, multiple: float = MULTIPLE
) -> Tracks:
    """Follow the modes of the first pose.

    Args:
        series: Modes at every pose, shapes (n, r) in common coordinates.
        weights: Mass matrix of every pose in those coordinates, (n, n); None compares as they are.
        multiple: Relative distance of frequencies below which modes are one multiple mode.

    Raises:
        ValueError: There is no pose, or numbers of modes or coordinates differ.
    """
    if len({modes.shapes.shape for modes in series}) != 1:
        raise ValueError(f"need poses with the same modes, not {[modes.shapes.shape for modes in series]}")
    shapes, r = [series[0].shapes], series[0].omega.size
    order, quality = [np.arange(r, dtype=np.intp)], [np.ones(r)]
    for i, modes in enumerate(series[1:], start=1):
        weight = None if weights is None else weights[i]
        turned = _unmix(modes, shapes[-1], weight, multiple)
        alike = mac(shapes[-1], turned, weight)
        chosen = scipy.optimize.linear_sum_assignment(alike, maximize=True)[1]
        order.append(chosen)
        quality.append(alike[np.arange(r), chosen])
        shapes.append(align_signs(turned[:, chosen], shapes[-1], weight))
    omega = [modes.omega[chosen] for modes, chosen in zip(series, order, strict=True)]
    return Tracks(np.array(order), np.array(omega), np.array(shapes), np.array(quality))


def group_modes(omega: Array, tolerance: float = MULTIPLE) -> list[NDArray[np.intp]]:
    """Return modes of ``omega`` (r,) in groups whose frequencies follow within a relative tolerance."""
    order = np.argsort(omega, kind="stable")
    gaps = np.diff(omega[order]) > tolerance * np.maximum(omega[order][1:], np.finfo(float).tiny)
    return list(np.split(order, np.flatnonzero(gaps) + 1)) if omega.size else []


def _unmix(modes: Modes, before: Array, weight: Array | None, multiple: float) -> Array:
    """Return the shapes with every multiple mode rotated onto the shapes before that it continues, (n, r)."""
    shapes = modes.shapes.copy()
    for group in group_modes(modes.omega, multiple):
        if group.size > 1:
            covered = mac(before, shapes[:, group], weight).sum(axis=1)  # share of each in the group's span
            nearest = np.sort(np.argsort(-covered, kind="stable")[: group.size])
            turned = align_rotation(shapes[:, group], before[:, nearest], weight)
            alike = mac(shapes[:, group], turned, weight)
            place = scipy.optimize.linear_sum_assignment(alike, maximize=True)[1]
            shapes[:, group] = turned[:, place]  # each beside the frequency that it is nearest to
    return shapes
