"""Environment of nodes that are started together: where the user says nothing, this holds.

They find each other on this machine only, BLAS has one thread, and Fast DDS finds who starts again soon and
keeps no memory of messages that are gone (``config/middleware/fastdds.xml``); profiles of the user's own win.
"""

from __future__ import annotations

import os
from collections.abc import Mapping

from flexarm_model.reading.share import share_folders

PROFILES = "FASTRTPS_DEFAULT_PROFILES_FILE"
LIFE = "FLEXARM_LIFE"  # read by that file
_OWN = (PROFILES, "FASTDDS_DEFAULT_PROFILES_FILE", "RMW_FASTRTPS_USE_QOS_FROM_XML")


def defaults(environment: Mapping[str, str] = os.environ) -> dict[str, str]:
    """Return variables for those that the user has not set; his own win."""
    chosen = {"ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST", "OMP_NUM_THREADS": "1"}
    places = (folder / "config" / "middleware" / "fastdds.xml" for folder in share_folders("flexarm_bringup"))
    profiles = next((place for place in places if place.is_file()), None)
    if profiles is not None and not any(environment.get(name) for name in _OWN):
        chosen |= {PROFILES: str(profiles), "RMW_FASTRTPS_USE_QOS_FROM_XML": "1", **of_life(0)}
    return chosen


def of_life(count: int) -> dict[str, str]:
    """Return what tells a process started ``count`` times before to hear at other ports than last time."""
    return {LIFE: "1" if count % 2 else ""}
