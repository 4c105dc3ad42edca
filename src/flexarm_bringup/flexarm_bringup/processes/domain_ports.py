"""Whether anybody can be in a ROS domain on this machine, by the ports that participants of DDS must have.

Those of domain d are 7400 + 250 d and the 249 that follow (RTPS 2.5, 9.6.2.3), whatever the middleware
calls itself; who has none is not in the domain. It takes no time, where discovery takes seconds.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

TABLES = tuple(Path("/proc/net") / name for name in ("udp", "udp6"))
FIRST, PER_DOMAIN = 7400, 250


def may_be_used(domain: int, tables: Sequence[Path] = TABLES) -> bool:
    """Return whether a port of a ROS domain is in use on this machine; also if that cannot be known.

    Args:
        domain: Its number, 0 to 232.
        tables: Of the sockets, as Linux writes them.
    """
    first = FIRST + PER_DOMAIN * domain
    try:
        lines = [line for table in tables for line in table.read_text(encoding="ascii").splitlines()[1:]]
    except OSError:
        return True
    return any(first <= int(line.split()[1].rpartition(":")[2], 16) < first + PER_DOMAIN for line in lines)
