"""Message types of bags: the standard ones, and ours read from their .msg text.

Nothing here needs ROS: a bag can be read on a machine that has none.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from flexarm_bringup.installed import find_package

PACKAGE = "flexarm_interfaces"


@cache
def bag_types() -> Typestore:
    """Return the types of ROS 2 Jazzy and those of flexarm_interfaces.

    Raises:
        FileNotFoundError: The .msg files are neither installed nor in the source tree.
    """
    store = get_typestore(Stores.ROS2_JAZZY)
    known = {}
    for path in sorted(_message_folder().glob("*.msg")):
        known.update(get_types_from_msg(path.read_text(encoding="utf8"), f"{PACKAGE}/msg/{path.stem}"))
    store.register(known)
    return store


def _message_folder() -> Path:
    prefix = find_package(PACKAGE)
    source = Path(__file__).parents[3] / PACKAGE / "msg"
    folders = ([prefix / "share" / PACKAGE / "msg"] if prefix else []) + [source]
    for folder in folders:
        if folder.is_dir():
            return folder
    raise FileNotFoundError(f"no message definitions in {', '.join(map(str, folders))}")
