"""The stamps of what drives measure: how many periods have passed, and whether they keep the arm's period.

A stamp is the begin of a period. The guard's limits and its way by velocity are made for that period, and
stamps that scatter by half of it no longer say which period a state is of.
"""

from __future__ import annotations

import math
from collections import deque

from flexarm_controller.guarding.rest_watch import REST_TIME
from flexarm_model.conversions import NS_PER_S

TOLERANCE = 0.05  # of the period; off by 0.1 a moving arm is stopped: way and velocity do not fit
NEAR = (0.5, 1.5)  # periods between two stamps of which none between was lost


class DriveClock:
    """Reads the stamps of the drives.

    Attributes:
        fault: Why the newest stamp stops the arm; empty when it does not.
    """

    def __init__(self, period_ns: int, longest: float) -> None:
        """Know no stamp.

        Args:
            period_ns: Of the motors [ns].
            longest: Gap that no silence may reach [s].
        """
        self._period_ns, self._longest_ns = period_ns, longest * NS_PER_S
        self._stamp_ns, self.fault = -1, ""
        self._gaps: deque[int] = deque(maxlen=max(1, round(REST_TIME * NS_PER_S / period_ns)))

    def take(self, stamp_ns: int) -> int:
        """Take the stamp of a state [ns]; return how many periods after the last one, at least 1."""
        gap = stamp_ns - self._stamp_ns if self._stamp_ns >= 0 else self._period_ns
        is_first, self._stamp_ns = self._stamp_ns < 0, stamp_ns
        periods = round(gap / self._period_ns)
        self.fault = "" if 0 < periods * self._period_ns <= self._longest_ns else self._say(gap)
        if not 0 <= gap <= self._longest_ns:
            self._gaps.clear()
        elif not is_first:
            self._gaps.append(gap)
        return max(periods, 1)

    def unready(self) -> str:
        """Return what is wrong with the stamps of the last 250 ms; empty when nothing is."""
        if not self._gaps:
            return self.fault
        low, high = (share * self._period_ns for share in NEAR)
        near = [gap for gap in self._gaps if low < gap < high]
        is_clear = 2 * len(near) > len(self._gaps)
        usual = math.fsum(near) / len(near) if is_clear else sorted(self._gaps)[len(self._gaps) // 2]
        if usual > 0 and abs(usual - self._period_ns) > TOLERANCE * self._period_ns:
            return f"drives tell every {_ms(usual)}, {self._expected}"
        least = min(self._gaps)
        return "" if least > low else self._say(least)

    @property
    def _expected(self) -> str:
        return f"the arm's period is {_ms(self._period_ns)}"

    def _say(self, gap: float) -> str:
        """Return what is wrong with two stamps that are so far apart [ns]."""
        if gap == 0:
            at = "is 0" if self._stamp_ns == 0 else "does not advance"
            return f"stamp of the drives {at}: it has to be the begin of each period"
        if 0 < gap <= self._longest_ns:
            return f"stamps of two states of the drives are {_ms(gap)} apart, {self._expected}"
        return f"clock of the drives jumped by {gap / NS_PER_S:.3g} s"


def _ms(ns: float) -> str:
    return f"{1e3 * ns / NS_PER_S:.3g} ms"
