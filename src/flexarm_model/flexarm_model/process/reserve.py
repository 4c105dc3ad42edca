"""A node in reserve: it has loaded its libraries, made what it can (``ahead``), and waits for its call.

Who starts it marks its environment and gives it a line (``life_line``). One byte from here tells that the
libraries are there, one byte from there that the place is empty; when the other end is closed, nobody will
ever call. A reserve has no name and no ROS domain: no node knows of it.
"""

from __future__ import annotations

import gc
import os
import socket
import sys
from collections.abc import MutableMapping

from flexarm_model.process.loading import Loading

MARK = "FLEXARM_RESERVE"
LOADED, COME = b"l", b"c"
_NICE = 10  # of the thread that loads: the nodes at work come first


def is_reserve(environment: MutableMapping[str, str] = os.environ) -> bool:
    """Tell whether this process was started as one; what it starts itself is none."""
    return environment.pop(MARK, "") != ""


def stand_by(module: str, line: socket.socket) -> bool:
    """Load a module, make what it says and wait; return whether the reserve was called on its line."""

    def make() -> None:
        """Make what the node asks for first."""
        from flexarm_model.process.ahead import make_ahead  # an ordinary process does without

        make_ahead(module, sys.argv)

    Loading((module,), _NICE, make).wait()
    gc.collect()
    gc.freeze()
    try:
        line.sendall(LOADED)
        return line.recv(1) == COME
    except OSError:  # the other end was killed
        return False
