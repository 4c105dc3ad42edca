"""Counts the control periods of a stream of messages from their stamps.

Stamps may begin anywhere in a period of the clock, scatter, and drift away from the count: the stamp of a
period is tracked. Every stamp is of the period whose tracked stamp is nearest, and draws that along slowly::

    k = k' + round((stamp - s') / T)        s = s' + (k - k') T        s += gain (stamp - s)

A rate that is off by more than can be followed (5 % is borne, docs/drives.md) leaves a period out or says one
twice now and then, and the count stays true to the clock.

Streams of other phases each have their own count; a led one is moved to the period of its leader that is
nearest, so that all agree which instant is meant.
"""

from __future__ import annotations

from flexarm_model.conversions import NS_PER_S

# s; scatter of a fifth of a period moves the tracked stamp by 1 % of one, 20 ppm by 2 % at 200 Hz
FOLLOWING = 5.0
ASTRAY = 0.7  # periods from the leader's: half of one is the border, and a fifth of one may be scatter
LONGEST_GAP = 0.1  # s; after a longer one, or a step back, stamps may have another phase: it begins anew
THIN = 0.1  # share of periods without a stamp that is told: a rate that is off by 5 % leaves out half of that
FULL = 0.05  # share from which it is taken back


class PeriodCount:
    """See the module.

    Attributes:
        is_thin: So many periods have had no stamp lately that it is worth telling.
    """

    def __init__(self, period_ns: int, leader: PeriodCount | None = None) -> None:
        """Count from the clock's zero.

        Args:
            period_ns: Control period [ns].
            leader: Whose periods are meant; None: it leads.
        """
        self._period_ns, self._leader = period_ns, leader
        self._gain = period_ns / (FOLLOWING * NS_PER_S)
        self._heard = 0  # stamps since it began
        self._last, self._at_ns = 0, 0  # period, and its tracked stamp
        self._empty = 0.0  # share of periods
        self.is_thin = False

    def nearest(self, stamp_ns: int) -> int:
        """Return the period whose tracked stamp is nearest to a stamp [ns]."""
        return self._last + round((stamp_ns - self._at_ns) / self._period_ns)

    def stamp_ns(self, period: float) -> int:
        """Return the tracked stamp of a period, or of a place between two [ns]."""
        return self._at_ns + round((period - self._last) * self._period_ns)

    def count(self, stamp_ns: int) -> int:
        """Return the period of the next stamp [ns], and go along with it."""
        passed_ns = stamp_ns - self._at_ns
        if not self._heard or not -LONGEST_GAP * NS_PER_S <= passed_ns <= LONGEST_GAP * NS_PER_S:
            self._last, self._at_ns = (self._leader or self).nearest(stamp_ns), stamp_ns
            self._heard = 1
            return self._last
        self._go_on(self.nearest(stamp_ns) - self._last)
        off_ns = stamp_ns - self._at_ns
        self._at_ns += round(off_ns * max(1.0 / self._heard, self._gain))  # at first their mean
        self._stay_with_leader()
        return self._last

    def _go_on(self, steps: int) -> None:
        """Take a stamp so many periods after the last."""
        self._heard += 1
        self._last, self._at_ns = self._last + steps, self._at_ns + steps * self._period_ns
        if steps > 0:
            self._empty += self._gain * (steps - 1 - steps * self._empty)
            self.is_thin = self._empty > (FULL if self.is_thin else THIN)

    def _stay_with_leader(self) -> None:
        if self._leader is None:
            return
        off = (self._at_ns - self._leader.stamp_ns(self._last)) / self._period_ns
        if abs(off) > ASTRAY:
            self._last += round(off)
