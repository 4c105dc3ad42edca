"""Frequencies and damping of a description with changed values, and those values themselves."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_model.identification.described_arm import DescribedArm
from flexarm_model.identification.modal_misfit import Serve
from flexarm_model.identification.unknown import Unknown
from flexarm_model.reading.config import read_content
from flexarm_model.settings.strict_yaml import ConfigError

Array = NDArray[np.float64]


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
    value: Any = read_content(path, preset)
    for part in dotted.split("."):
        try:
            value = value[int(part) if isinstance(value, list) else part]
        except (KeyError, IndexError, ValueError, TypeError):
            raise ConfigError(f"{path}: '{dotted}': no such value; '{part}' is not there") from None
    number, _, unit = str(value).strip().partition(" ")
    try:
        return Unknown(dotted, float(number), unit.strip(), spread)
    except ValueError:
        raise ConfigError(f"{path}: '{dotted}': {value!r} is not a number with a unit") from None
