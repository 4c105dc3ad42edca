"""The description that a served model was made of: found by the hash that the model quotes."""

from __future__ import annotations

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.strict_yaml import ConfigError, read_yaml


def described(manipulator: str, config_id: str) -> ManipulatorConfig | None:
    """Return the description with the preset that has this hash; None where there is no such file.

    Args:
        manipulator: Name of one that comes along, or a YAML file.
        config_id: Content hash.

    Raises:
        ConfigError: The file cannot be understood.
    """
    try:
        path = find_manipulator(manipulator)
    except ConfigError:  # a file of the user's: nobody told us where it lies
        return None
    for preset in (*read_yaml(path).get("presets", {}), ""):
        config = load_config(path, preset)
        if config.config_id == config_id:
            return config
    return None
