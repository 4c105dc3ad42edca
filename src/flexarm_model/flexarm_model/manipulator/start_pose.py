"""A manipulator that starts somewhere else than at home."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.settings.strict_yaml import ConfigError
from flexarm_model.settings.units import axis_dimension, si_unit

Array = NDArray[np.float64]


def starting_at(config: ManipulatorConfig, pose: Sequence[float] | Array) -> ManipulatorConfig:
    """Return the description with another home; its ``config_id`` stays, it is the same arm, equally damped.

    Args:
        config: The manipulator.
        pose: Actuated axes [rad or m], (n_theta,); empty: its own home.

    Raises:
        ConfigError: The pose has not one value for every axis, or one is beyond the ends of its range.
    """
    if not len(pose):
        return config
    if len(pose) != len(config.actuated):
        names = ", ".join(config.actuated)
        raise ConfigError(f"start: {len(pose)} values; expected one each for {names}")
    for value, (name, axis) in zip(pose, config.actuated.items(), strict=True):
        if not axis.lower <= value <= axis.upper:  # also where it is not a number
            unit = si_unit(axis_dimension(name, "position"))
            raise ConfigError(
                f"start: {name}: {value:g} {unit}; allowed {axis.lower:.6g} to {axis.upper:.6g}"
            )
    return replace(config, home=np.array(pose, dtype=float), damped_at=config.damping_pose)
