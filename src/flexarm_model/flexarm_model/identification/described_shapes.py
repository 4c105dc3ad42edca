"""Shapes of a description's modes at its sensors, for values and poses that change.

An output tells a mode in its own kind: an encoder or a gauge by ``C_pos phi``, an accelerometer by
``-omega^2 C_acc phi``. Normal modes, scaled so that the largest entry is 1 in units of every output's own
largest value as described.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree
from flexarm_model.tree.sensors import output_names, output_units

Array = NDArray[np.float64]
RIGID_HZ = 1e-3  # below it a mode is the free motion of a motor
ACCELERATION = "m/s^2"

Shapes = Callable[[Mapping[str, str | float], Array], Array]
"""Shapes of the changed description at a pose, slowest mode first, (modes, n_out)."""


def described_shapes(path: Path, preset: str, motors_locked: bool, outputs: Sequence[str]) -> Shapes:
    """Return what serves the shapes of a description's served modes, not yet scaled.

    Args:
        path: The description.
        preset: Its preset.
        motors_locked: Modes with the actuated axes held instead of free.
        outputs: Channels "sensor.channel" of the description.

    Raises:
        ValueError: One of the channels does not exist.
    """

    def shapes(changes: Mapping[str, str | float], pose: Array) -> Array:
        """Return the shapes of the changed arm at a pose."""
        config = replace(load_config(path, preset, changes), home=np.array(pose, dtype=float))
        model = linearize(ReducedTree(config, use_compiler=False))
        names, units = output_names(config), output_units(config)
        rows = [names.index(output) for output in outputs]
        first = model.n_theta if motors_locked else 0
        squares, phi = eigh(model.K[first:, first:], model.M[first:, first:])
        elastic = squares > (2 * np.pi * RIGID_HZ) ** 2
        squares, phi = squares[elastic], phi[:, elastic]
        position, acceleration = (
            C[rows][:, first:] @ phi for C in (model.outputs.C_pos, model.outputs.C_acc)
        )
        tells_acceleration = np.array([units[row] == ACCELERATION for row in rows])
        seen = np.where(tells_acceleration[:, None], -squares * acceleration, position)
        return np.asarray(seen.T)

    return shapes


def in_size(shapes: Array, size: Array) -> Array:
    """Return shapes in units of every output's size, of length one, largest entry positive."""
    scaled = shapes / size
    length = np.linalg.norm(scaled, axis=1, keepdims=True)
    signs = np.sign(np.take_along_axis(scaled, np.argmax(abs(scaled), axis=1)[:, None], axis=1))
    return np.asarray(scaled * signs / np.maximum(length, np.finfo(float).tiny))
