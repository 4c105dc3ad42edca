"""The description that a served model was made of: found by the hash that the model quotes."""

from __future__ import annotations

from collections.abc import Iterator

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.same_arm import Served
from flexarm_model.settings.strict_yaml import ConfigError, read_yaml


def described(manipulator: str, config_id: str) -> ManipulatorConfig | None:
    """Return the description with the preset that has this hash; None where there is no such file.

    Args:
        manipulator: Name of one that comes along, or a YAML file.
        config_id: Content hash.

    Raises:
        ConfigError: The file cannot be understood.
    """
    return next((config for config in _presets_of(manipulator) if config.config_id == config_id), None)


def foreign_description(manipulator: str, served: Served) -> str:
    """Return in one line that a served model is not of a description; empty when it is.

    Args:
        manipulator: Name of one that comes along, or a YAML file.
        served: The model.

    Raises:
        ConfigError: The file cannot be understood.
    """
    known = {config.config_id: config for config in _presets_of(manipulator)}
    if not known or served.config_id in known:
        return ""
    ids = [
        f"{config_id}{config.preset and f' (preset {config.preset})'}" for config_id, config in known.items()
    ]
    name = next(iter(known.values())).name
    return (
        f"another arm runs: '{served.manipulator}', config {served.config_id}, not {manipulator}: "
        f"'{name}', config {' or '.join(ids)}"
    )


def _presets_of(manipulator: str) -> Iterator[ManipulatorConfig]:
    """Yield a description with every preset it has, and without; none where there is no such file."""
    try:
        path = find_manipulator(manipulator)
    except ConfigError:  # a file of the user's: nobody told us where it lies
        return
    for preset in (*read_yaml(path).get("presets", {}), ""):
        yield load_config(path, preset)
