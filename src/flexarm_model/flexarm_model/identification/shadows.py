"""Poles beside a mode that no linear arm has: they have its shape at the axes, but other motors drive them.

Where outputs are the axes that the inputs drive, the residue of a mode is ``psi psi'``: two modes of one
shape there are driven alike, too. A pole of the shape of a stronger mode within a bandwidth that is driven
otherwise is what an arm leaves that is not linear, in large motions above all: its frequency wanders with the
pose, and two poles follow that better than one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_model.identification.stabilisation import likeness
from flexarm_model.modal.residues import ModalFit

ALIKE = 0.98  # assurance criterion from which two shapes at the axes are one [1]
UNLIKE = 0.9  # below it two participations are of different inputs [1]


def shadow_of(model: ModalFit, axes: Sequence[int]) -> NDArray[np.intp]:
    """Return which stronger mode every pole stands beside without being a mode; -1 for none, (r,).

    Args:
        model: Identified modes.
        axes: Outputs that are the axes that the inputs drive.
    """
    found = np.full(model.poles.size, -1, np.intp)
    if len(axes) < model.residues.shape[2] or model.residues.shape[2] < 2:
        return found
    at_axes = model.residues[:, list(axes)]
    shapes, sizes, participations = np.linalg.svd(at_axes, full_matrices=False)
    for i in range(found.size):
        for j in np.flatnonzero(sizes[:, 0] > sizes[i, 0]):
            is_near = abs(model.poles[i] - model.poles[j]) < -2 * model.poles[j].real
            is_shape = likeness(shapes[i, :, 0], shapes[j, :, 0]) > ALIKE
            if is_near and is_shape and likeness(participations[i, 0], participations[j, 0]) < UNLIKE:
                found[i] = j
    return found
