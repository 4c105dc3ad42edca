"""What a run by the clock is judged by: counts of guard and controller over a window, and bounds on them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from flexarm_bringup.page.check import Check
from flexarm_bringup.processes.late_cycles import LateCycles
from flexarm_bringup.processes.standstill import Witnesses
from flexarm_bringup.realtime.late_checks import late_checks, standstill_rows

SHARE = 0.01  # of the cycles that may overrun, or may be without a fresh command


@dataclass(frozen=True)
class Counts:
    """Counters of one instant; all grow from the start of their node.

    Attributes:
        ticks: Motor periods.
        without_command: Those without a fresh command while armed.
        answers: Control periods that the controller answered.
        overruns: Answers that took longer than the controller's time budget.
        missed: Control periods that it never answered.
    """

    ticks: int = 0
    without_command: int = 0
    answers: int = 0
    overruns: int = 0
    missed: int = 0

    def since(self, earlier: Counts) -> Counts:
        """Return what was counted since an earlier instant."""
        return Counts(*(getattr(self, name) - getattr(earlier, name) for name in Counts.__match_args__))


@dataclass(frozen=True)
class Figures:
    """A finished run.

    Attributes:
        began: When the watch began [s], of the steady clock.
        seconds: How long it lasted [s].
        counts: In that time.
        modes: Answers that the controller told, by mode.
        steps: CPU time of their controller steps [s].
        late: Guard cycles that were late.
        stop: Why the guard stopped the arm; empty when it did not.
        witnesses: Of standstills of the machine itself; None without.
    """

    began: float
    seconds: float
    counts: Counts
    modes: Mapping[str, int]
    steps: Sequence[float]
    late: LateCycles
    stop: str
    witnesses: Witnesses | None = None

    def rows(self) -> list[tuple[str, float]]:
        """Return what is printed beside the checks."""
        steps = np.array(self.steps or [0.0])
        return [
            ("seconds watched", self.seconds),
            ("guard cycles", float(self.counts.ticks)),
            ("control periods answered", float(self.counts.answers)),
            *((f"answers told, by {mode}", float(count)) for mode, count in sorted(self.modes.items())),
            ("control periods not answered", float(self.counts.missed)),
            ("controller step, CPU time, median [us]", 1e6 * float(np.median(steps))),
            ("controller step, CPU time, 99th percentile [us]", 1e6 * float(np.percentile(steps, 99))),
            *standstill_rows(self.witnesses, self.began, self.seconds),
        ]

    def checks(self) -> list[Check]:
        """Return the bounds of real time, and whether they were kept."""
        c, share = self.counts, f"less than {100 * SHARE:g} %"
        overruns, without = c.overruns / max(c.answers, 1), c.without_command / max(c.ticks, 1)
        accounted = c.answers + c.missed
        is_quick = c.answers > 0 and overruns < SHARE
        return [
            Check("the arm was not stopped", "armed to the end", self.stop or "armed", not self.stop),
            *late_checks(self.late, c.ticks, self.witnesses),
            Check("controller overruns", share, f"{100 * overruns:.3g} %", is_quick),
            Check("ticks without a fresh command", share, f"{100 * without:.3g} %", without < SHARE),
            Check(
                "guard cycles answered or told as missed", f"at least {100 * (1 - SHARE):g} %",
                f"{100 * accounted / max(c.ticks, 1):.4g} %", accounted >= (1 - SHARE) * c.ticks,
            ),
        ]  # fmt: skip
