"""Shapes of a description's modes at its sensors, for values and poses that change.

An output tells a mode of frequency omega by ``(C_pos - omega^2 C_acc) phi``: an encoder or a gauge by the
first alone, an accelerometer by its motion and by the weight that it feels as it tilts. Normal modes, scaled
so that the largest entry is 1 in units of every output's own largest value as described.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_model.identification.described_arm import ArmModes, DescribedArm

Array = NDArray[np.float64]

Shapes = Callable[[Mapping[str, str | float], Array], Array]
"""Shapes of the changed description at a pose, slowest mode first, (modes, n_out)."""


def described_shapes(
    path: Path, preset: str, motors_locked: bool, outputs: Sequence[str], arm: DescribedArm | None = None
) -> Shapes:
    """Return what serves the shapes of a description's modes, not yet scaled.

    Args:
        path: The description.
        preset: Its preset.
        motors_locked: Modes with the actuated axes held instead of free.
        outputs: Channels "sensor.channel" of the description.
        arm: The same arm where its answers are shared; None makes one.

    Raises:
        ValueError: One of the channels does not exist.
    """
    described = arm or DescribedArm(path, preset, motors_locked)

    def shapes(changes: Mapping[str, str | float], pose: Array) -> Array:
        """Return the shapes of the changed arm at a pose."""
        return seen_at(described.modes(changes, pose), outputs)

    return shapes


def seen_at(modes: ArmModes, outputs: Sequence[str]) -> Array:
    """Return what outputs see of modes, not scaled, (modes, n_out).

    Raises:
        ValueError: One of the outputs does not exist.
    """
    rows = [modes.outputs.names.index(output) for output in outputs]
    moved, accelerated = (C[rows] @ modes.shapes for C in (modes.outputs.C_pos, modes.outputs.C_acc))
    return np.asarray((moved - modes.omega**2 * accelerated).T)


def in_size(shapes: Array, size: Array) -> Array:
    """Return shapes (r, n_out) in units of every output's size (n_out,), length 1, largest entry positive."""
    scaled = shapes / size
    length = np.linalg.norm(scaled, axis=1, keepdims=True)
    signs = np.sign(np.take_along_axis(scaled, np.argmax(abs(scaled), axis=1)[:, None], axis=1))
    return np.asarray(scaled * signs / np.maximum(length, np.finfo(float).tiny))
