"""The class of a message by the name of its type."""

from __future__ import annotations

import importlib
from functools import cache
from typing import Any


@cache
def message_class(kind: str) -> Any:
    """Return the class of a type, "sensor_msgs/msg/JointState".

    Raises:
        ModuleNotFoundError: Its package is not installed.
        AttributeError: The package that is installed has no such message.
    """
    package, folder, name = kind.split("/")
    return getattr(importlib.import_module(f"{package}.{folder}"), name)
