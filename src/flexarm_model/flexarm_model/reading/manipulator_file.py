"""Find a manipulator's file: by path, or by the name of one that flexarm brings along."""

from __future__ import annotations

from pathlib import Path

from flexarm_model.reading.share import share_folders
from flexarm_model.settings.strict_yaml import ConfigError

PACKAGE = "flexarm_bringup"
FOLDER = Path("config") / "manipulators"


def find_manipulator(name: str) -> Path:
    """Return the YAML file of a manipulator.

    Args:
        name: A path, or the name of a file in the bringup package's config/manipulators.

    Raises:
        ConfigError: There is no such file; lists those that come along.
    """
    if name.endswith((".yaml", ".yml")):
        return Path(name)
    folders = [share / FOLDER for share in share_folders(PACKAGE) if (share / FOLDER).is_dir()]
    for folder in folders:
        if (folder / f"{name}.yaml").is_file():
            return folder / f"{name}.yaml"
    known = sorted({path.stem for folder in folders for path in folder.glob("*.yaml")})
    raise ConfigError(
        f"manipulator: '{name}': expected a .yaml file or one of {', '.join(known) or 'none found'}"
    )
