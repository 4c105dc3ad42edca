"""With what a bag was recorded: the manipulator and the settings of the nodes."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

from flexarm_bringup.bags.bag_reader import Bag
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.bags.described_arm import kept_description, named_files
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.settings.strict_yaml import ConfigError

TOLD = ("description", "preset", "settings")
SHOWN = 60  # characters of a wrong value in a message


def configuration(bag: Bag) -> tuple[ManipulatorConfig, dict[str, dict[str, Any]]]:
    """Return the manipulator and the settings of the nodes that a bag was recorded with.

    Raises:
        BagError: The bag does not say it, or lacks files that its description names.
        ConfigError: The description is not understood.
    """
    missing = [key for key in TOLD if key not in bag.custom]
    if missing:
        said = f"does not say with which {', '.join(missing)} it was recorded"
        raise BagError(f"{bag.path}: {said}; --manipulator NAME names its arm")
    return _read_manipulator(bag), recorded_settings(bag)


def recorded_settings(bag: Bag) -> dict[str, dict[str, Any]]:
    """Return the settings that are kept in a bag which says them, by node.

    Raises:
        BagError: They are no JSON, or not values by node.
    """
    try:
        settings = json.loads(bag.custom["settings"])
    except (ValueError, RecursionError) as error:
        raise BagError(f"{bag.path}: its settings are not JSON: {error}") from error
    if not isinstance(settings, dict) or not all(isinstance(given, dict) for given in settings.values()):
        raise BagError(f"{bag.path}: its settings are not values by node: {_short(settings)}")
    return settings


def _read_manipulator(bag: Bag) -> ManipulatorConfig:
    """Return the manipulator; files that it names lie in the bag, where they can be read later, too."""
    if bag.described_by is not None:
        return load_config(bag.described_by, bag.custom["preset"])
    kept = kept_description(bag.path)
    if kept is not None and kept.read_text(encoding="utf8", errors="replace") == bag.custom["description"]:
        return load_config(kept, bag.custom["preset"])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "bag.yaml"  # never a name that the bag gives
        path.write_text(bag.custom["description"], encoding="utf8")
        try:
            if named := named_files(path):
                raise BagError(f"{bag.path}: its description names files that it lacks: {', '.join(named)}")
            return load_config(path, bag.custom["preset"])
        except ConfigError as error:
            said = str(error).replace(f"{path}: ", "")
            raise ConfigError(f"{bag.path}: its description: {said}") from None


def _short(value: object) -> str:
    return text if len(text := repr(value)) <= SHOWN else f"{text[:SHOWN]} ..."
