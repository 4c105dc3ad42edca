"""Environment of nodes that are started together: where the user says nothing, this holds.

They find each other on this machine only, and nobody else finds them: Fast DDS listens nowhere else
(``config/middleware/fastdds_alone.xml``). It finds who starts again soon, and keeps no memory of messages
that are gone (``fastdds.xml`` says how). BLAS has one thread; ROS has a folder for its logs where a service
manager gives no home. Profiles of the user's own win.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from pathlib import Path

from flexarm_model.process.ros_arguments import domain
from flexarm_model.reading.share import share_folders
from flexarm_model.settings.strict_yaml import ConfigError

PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE"
PROFILE_VARIABLES = (PROFILES, "FASTDDS_DEFAULT_PROFILES_FILE")
RANGE, HERE, PEERS = "ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST", "ROS_STATIC_PEERS"
LIFE = "FLEXARM_LIFE"  # read by that file
LOGS = "ROS_LOG_DIR"
_PLACES_OF_LOGS = (LOGS, "ROS_HOME", "HOME")  # that rcl knows
_OWN = (*PROFILE_VARIABLES, "RMW_FASTRTPS_USE_QOS_FROM_XML")


def defaults(environment: Mapping[str, str] = os.environ) -> dict[str, str]:
    """Return variables for those that the user has not set; his own win."""
    chosen = {RANGE: HERE, "OMP_NUM_THREADS": "1"}
    if not any(environment.get(name) for name in _PLACES_OF_LOGS):
        chosen[LOGS] = str(_home() / ".ros" / "log")
    is_alone = (environment.get(RANGE) or HERE) == HERE and not environment.get(PEERS)
    name = "fastdds_alone.xml" if is_alone else "fastdds.xml"
    places = (folder / "config" / "middleware" / name for folder in share_folders("flexarm_bringup"))
    profiles = next((place for place in places if place.is_file()), None)
    if profiles is not None and not any(environment.get(name) for name in _OWN):
        chosen |= {PROFILES: str(profiles), "RMW_FASTRTPS_USE_QOS_FROM_XML": "1", **of_life(0)}
    return chosen


def check_domain(environment: Mapping[str, str] = os.environ) -> None:
    """Check that nodes can be started in the ROS domain of an environment.

    Raises:
        ConfigError: It is no domain; the message says what is allowed.
    """
    try:
        domain(environment)
    except ValueError as error:
        raise ConfigError(str(error)) from None


def has_domain(environment: Mapping[str, str] = os.environ) -> bool:
    """Say whether nodes can be started in the ROS domain of an environment."""
    try:
        check_domain(environment)
    except ConfigError:
        return False
    return True


def of_life(count: int) -> dict[str, str]:
    """Return what tells a process started ``count`` times before to hear at other ports than last time."""
    return {LIFE: "1" if count % 2 else ""}


def _home() -> Path:
    try:
        return Path.home()  # of the user, where the environment says none
    except RuntimeError:  # nobody knows the user: a container, say
        return Path(tempfile.gettempdir()) / f"flexarm-{os.getuid()}"
