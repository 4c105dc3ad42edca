"""A manipulator that starts somewhere else than at home."""

from __future__ import annotations

from dataclasses import replace

from flexarm_model.description import ManipulatorConfig
from flexarm_model.strict_yaml import ConfigError

HOME = "home"


def starting_at(config: ManipulatorConfig, pose: str) -> ManipulatorConfig:
    """Return the description with one of its poses as home; its ``config_id`` stays, it is the same arm.

    Args:
        config: The manipulator.
        pose: Name of a pose of the description, or "home".

    Raises:
        ConfigError: There is no such pose; lists those there are.
    """
    poses = {HOME: config.home, **config.poses}
    if pose not in poses:
        raise ConfigError(f"start: '{pose}': expected one of {', '.join(poses)}")
    return replace(config, home=poses[pose])
