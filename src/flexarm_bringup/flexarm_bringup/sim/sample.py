"""What a sensor delivers, when it is heard, and how its stamp comes to be late."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
_SLACK = 1e-6  # of a period; times are rounded
_NS = 1e9  # ns per s


class Sample(NamedTuple):  # not a dataclass: a dozen are made in every period
    """What a sensor delivers: value ``y`` (m,), SI, stamped ``late_ns`` after the instant ``tick``."""

    sensor: str
    kind: str
    tick: int
    y: Array
    late_ns: int = 0

    def stamped_later(self, delay: float, dt: float) -> Sample:
        """Return it with a stamp that is by ``delay`` [s] later, to the nanosecond; ``dt`` [s] is a tick."""
        period_ns, late_ns = round(_NS * dt), self.late_ns + round(_NS * delay)
        ticks = round(late_ns / period_ns)
        return self._replace(tick=self.tick + ticks, late_ns=late_ns - ticks * period_ns)


def ticks_until_heard(delay: float, dt: float) -> int:
    """Return the first tick at which what takes ``delay`` [s] has come: never before it, nor in the past."""
    return max(0, math.ceil(delay / dt - _SLACK))
