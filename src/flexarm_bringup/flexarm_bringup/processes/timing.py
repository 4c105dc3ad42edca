"""Who gets the processor when: priorities and cores of the nodes that keep time by the clock.

In a period the drives speak, the guard answers them, and estimator and controller work for the next command.
Guard and rig take turns, and so do estimator and controller. So each pair has one half of the cores: nobody
drives the other pair off its core in the middle of its work, caches stay warm, and the core of the guard has
room: one that real-time threads fill is given to the others for 50 ms at once (docs/realtime.md).
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any

# SCHED_RR by the clock: of each pair first who is waited for, while the other has work that nobody waits for
PRIORITIES = {"guard": 70, "rig": 60, "controller": 55, "estimator": 50}
REALTIME_PRIORITY = max(PRIORITIES.values())  # that a user must be allowed
BESIDE_THE_DRIVES = ("guard", "rig")


def timing(name: str, available: Iterable[int] | None = None) -> dict[str, Any]:
    """Return the parameters with which a node of ``PRIORITIES`` keeps time.

    Args:
        name: Of the node.
        available: Cores of the machine; those that this process may use if None.
    """
    cores = sorted(os.sched_getaffinity(0) if available is None else available)
    half = len(cores) // 2
    own = cores[:half] if name in BESIDE_THE_DRIVES else cores[half:]
    return {"realtime_priority": PRIORITIES[name], **({"cores": own} if half else {})}
