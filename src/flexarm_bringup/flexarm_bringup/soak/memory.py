"""Memory of processes over a run: resident set by process, and how much it has grown.

Growth is the mean of the last ``END`` seconds minus that of the first ``END`` seconds after the warm-up, of
one life of a process; a process that was killed starts a new life. A leak that kills cut short is judged by
what the longest life would have grown by if it had lasted as long as the run. The slope is that of a straight
line through everything after the warm-up (least squares).
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

MB = 1e6  # bytes
PERIOD = 1.0  # s between two looks
END = 10.0  # s at either end of a life that are averaged
_PAGE = os.sysconf("SC_PAGE_SIZE")


@dataclass
class Life:
    """One process from its start to its end.

    Attributes:
        name: Of the node.
        pid: Process number.
        t: When it was looked at [s], of the run.
        rss: Its resident set then [MB].
    """

    name: str
    pid: int
    t: list[float] = field(default_factory=list)
    rss: list[float] = field(default_factory=list)

    def growth(self, warm_up: float) -> float | None:
        """Return how much it has grown [MB]; None for a life too short to tell."""
        t, rss = np.array(self.t), np.array(self.rss)
        if not t.size or t[-1] - t[0] < warm_up + 2.0 * END:
            return None
        first = (t >= t[0] + warm_up) & (t < t[0] + warm_up + END)
        return float(rss[t > t[-1] - END].mean() - rss[first].mean())

    def growth_over(self, seconds: float, warm_up: float) -> float | None:
        """Return what it would have grown by at its rate in ``seconds`` [MB]; None for a life too short."""
        growth = self.growth(warm_up)
        if growth is None:
            return None
        judged = self.t[-1] - self.t[0] - warm_up - END
        return growth * max((seconds - warm_up - END) / judged, 1.0)

    def slope(self, warm_up: float) -> float | None:
        """Return how fast it grows [MB/min]; None for a life too short to tell."""
        if self.growth(warm_up) is None:
            return None
        t = np.array(self.t)
        warm = t >= t[0] + warm_up
        return float(60.0 * np.polyfit(t[warm], np.array(self.rss)[warm], 1)[0])


def shortest(warm_up: float) -> float:
    """Return how long a process must be looked at for its growth to be told [s]."""
    return warm_up + 2.0 * END + 2.0 * PERIOD  # the first and the last look may be late by one each


class MemoryLog:
    """Looks at the processes of a run.

    Attributes:
        lives: In the order in which they began.
    """

    def __init__(self) -> None:
        """Know of none."""
        self.lives: list[Life] = []
        self._newest: dict[str, Life] = {}

    def look(self, t: float, pids: dict[str, int]) -> None:
        """Note the memory of processes at ``t`` [s]; one that has ended is left out."""
        for name, pid in pids.items():
            rss = resident_mb(pid)
            if rss is None:
                continue
            life = self._newest.get(name)
            if life is None or life.pid != pid:
                life = self._newest[name] = Life(name, pid)
                self.lives.append(life)
            life.t.append(t)
            life.rss.append(rss)


def resident_mb(pid: int) -> float | None:
    """Return the resident set of a process [MB]; None when there is none."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1])
    except (OSError, IndexError):
        return None
    return pages * _PAGE / MB if pages else None
