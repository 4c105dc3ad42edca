"""The description of an arm that is to be moved: its motors must say what they can."""

from __future__ import annotations

from flexarm_controller.limits import limits_of
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.strict_yaml import ConfigError


def load_driven(manipulator: str, preset: str = "") -> ManipulatorConfig:
    """Load a manipulator that laws and a guard can be made for; later each of them would refuse it.

    Args:
        manipulator: Name, or path of a YAML file.
        preset: Of it.

    Raises:
        ConfigError: There is no such arm or preset, or a motor has no effort.
    """
    path = find_manipulator(manipulator)
    config = load_config(path, preset)
    try:
        limits_of(config)
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from None
    return config
