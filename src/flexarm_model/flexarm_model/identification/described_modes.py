"""Frequencies and damping of a description with changed values, and those values themselves."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_model.identification.described_arm import DescribedArm
from flexarm_model.identification.modal_misfit import Serve
from flexarm_model.identification.unknown import Unknown
from flexarm_model.reading.config import read_content
from flexarm_model.settings.strict_yaml import ConfigError

Array = NDArray[np.float64]
PART_OF = {"bodies": 1, "joints": 3}  # levels below which a body, or an axis of a joint, is described


def described_modes(path: Path, preset: str, motors_locked: bool, arm: DescribedArm | None = None) -> Serve:
    """Return what serves the modes of a description for given changes and pose.

    Args:
        path: The description.
        preset: Its preset.
        motors_locked: Modes with the actuated axes held, as under a brake, instead of free.
        arm: The same arm where its answers are shared; None makes one.
    """
    described = arm or DescribedArm(path, preset, motors_locked)

    def serve(changes: Mapping[str, str | float], pose: Array) -> tuple[Array, Array]:
        """Return frequencies [Hz] and damping ratios [1] of the elastic modes, (k,) each."""
        modes = described.modes(changes, pose)
        return modes.omega / (2 * np.pi), modes.zeta

    return serve


def read_unknown(path: Path, preset: str, dotted: str, spread: float) -> Unknown:
    """Return a parameter as the description has it.

    Raises:
        ConfigError: There is no such value, or it is no number.
    """
    content = read_content(path, preset)
    levels, value, part = dotted.split("."), content, ""
    for depth, level in enumerate(levels):
        try:
            value = value[int(level) if isinstance(value, list) else level]
        except (KeyError, IndexError, ValueError, TypeError):
            raise ConfigError(f"{path}: '{dotted}': no such value; '{level}' is not there") from None
        if depth == PART_OF.get(levels[0], -1):
            part = json.dumps(value, sort_keys=True, default=str)
    number, _, unit = str(value).strip().partition(" ")
    try:
        return Unknown(dotted, float(number), unit.strip(), spread, part)
    except ValueError:
        raise ConfigError(f"{path}: '{dotted}': {value!r} is not a number with a unit") from None
