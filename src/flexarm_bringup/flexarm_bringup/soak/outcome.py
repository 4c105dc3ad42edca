"""What a soak has shown: counts, bounds on them, and the page that tells it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from flexarm_bringup.page.check import Check
from flexarm_bringup.page.figures import Figure, drawing, to_figure
from flexarm_bringup.page.report import Cells, Column, Page, Table
from flexarm_bringup.processes.late_cycles import LateCycles
from flexarm_bringup.processes.standstill import Witnesses
from flexarm_bringup.realtime.late_checks import late_checks, standstill_rows
from flexarm_bringup.soak.memory import Life
from flexarm_bringup.soak.worst import Moment

GROWTH = 10.0  # MB; more is a leak
MM = 1e3


@dataclass(frozen=True)
class Outcome:
    """A finished soak.

    Attributes:
        name: Manipulator and preset.
        began: When it began [s], of the steady clock: all were ready.
        seconds: How long it lasted [s].
        warm_up: After the start of a process its memory is not judged so long [s].
        lives: Memory of every process.
        cycles: Periods of the guard.
        late: Those answered late or never.
        counts: What was done, by name.
        stops: Why the guard stopped the arm, and how often.
        tip_errors: Estimate from truth, by what went on; samples [m].
        errors: Subjects of /diagnostics that became an error, and how often.
        failure: Why it ended early; empty when it did not.
        own_ends: Processes that nobody killed and that ended, with exit code, and how often.
        witnesses: Of standstills of the machine itself; None without.
        worst: Moments in which the estimate was farthest from the truth.
    """

    name: str
    began: float
    seconds: float
    warm_up: float
    lives: Sequence[Life]
    cycles: int
    late: LateCycles
    counts: Mapping[str, int]
    stops: Mapping[str, int]
    tip_errors: Mapping[str, Sequence[float]]
    errors: Mapping[str, int]
    failure: str = ""
    own_ends: Mapping[str, int] = field(default_factory=dict)
    witnesses: Witnesses | None = None
    worst: Sequence[Moment] = ()

    def checks(self) -> list[Check]:
        """Return the bounds, and whether they were kept."""
        checks = [self._growth(name) for name in dict.fromkeys(life.name for life in self.lives)]
        moves = self.counts.get("moves done", 0)
        return [
            *checks,
            *late_checks(self.late, self.cycles, self.witnesses),
            Check("moves done", "at least one", str(moves), moves > 0),
            Check("ended by itself", "none", _ends(self.own_ends), not self.own_ends),
            Check("it came to its end", "yes", self.failure or "yes", not self.failure),
        ]

    def _growth(self, name: str) -> Check:
        """Judge the memory of a process: in its lives, and at the rate of the longest over the whole soak."""
        title, wanted = f"memory of {name} grows", f"at most {GROWTH:g} MB"
        lives = [one for one in self.lives if one.name == name and one.growth(self.warm_up) is not None]
        if not lives:
            return Check(title, wanted, "no life long enough to tell", False)
        most = max(one.growth(self.warm_up) or 0.0 for one in lives)
        longest = max(lives, key=lambda one: one.t[-1] - one.t[0])
        over = longest.growth_over(self.seconds, self.warm_up) or 0.0
        found = f"{most:.2f} MB; {over:.2f} MB at the rate of its longest life"
        return Check(title, wanted, found, max(most, over) <= GROWTH)

    def page(self) -> Page:
        """Return everything there is to tell."""
        lead = (
            f"{self.name}, by the clock over DDS, {self.seconds / 60:.1f} minutes of random moves, faults of "
            "sensors on the simulated rig, and processes killed and started again."
        )
        items = [
            self._memory(),
            _counted("done", self.counts),
            _counted("stops of the guard, by reason", self.stops),
            Table(
                "the machine itself",
                [Column("what"), Column("value", ".1f")],
                [[name, value] for name, value in standstill_rows(self.witnesses, self.began, self.seconds)],
            ),
        ]
        items += [
            self._tip(),
            self._moments(),
            _counted("subjects of /diagnostics that became an error", self.errors),
        ]
        data = {"lives": [vars(life) for life in self.lives]}
        return Page("flexarm soak", lead, [*items, self._curves()], self.checks(), data=data)

    def _memory(self) -> Table:
        columns = [Column("process"), Column("life", "d"), Column("seconds", ".0f")]
        columns += [Column("RSS at the end, MB", ".1f"), Column("grown, MB", ".2f"), Column("MB/min", ".3f")]
        rows: list[Cells] = []
        seen: Counter[str] = Counter()
        for life in self.lives:
            seen[life.name] += 1
            figures = life.growth(self.warm_up), life.slope(self.warm_up)
            rows.append([life.name, seen[life.name], life.t[-1] - life.t[0], life.rss[-1], *figures])
        note = (
            f"grown since {self.warm_up:.0f} s after the start of the process; – for a life too short to tell"
        )
        return Table("memory", columns, rows, [note])

    def _tip(self) -> Table:
        columns = [Column("while"), Column("samples", "d"), Column("RMS, mm", ".3f")]
        columns.append(Column("largest, mm", ".3f"))
        rows: list[Cells] = []
        for what, values in self.tip_errors.items():
            error = MM * np.array(values or [np.nan])
            rows.append([what, len(values), float(np.sqrt((error**2).mean())), float(error.max())])
        return Table("tip: estimate from truth", columns, rows)

    def _moments(self) -> Table:
        columns = [Column("at, s", ".2f"), Column("error, mm", ".1f"), Column("while"), Column("usable")]
        columns += [Column("the estimator said"), Column("last fault of a sensor")]
        rows: list[Cells] = [
            [at.t, MM * at.error, at.doing, "yes" if at.is_usable else "no", at.said, at.fault]
            for at in self.worst
        ]
        return Table("tip: farthest from the truth", columns, rows)

    def _curves(self) -> Figure:
        with drawing() as plot:
            axes = plot.subplots()
            names = list(dict.fromkeys(life.name for life in self.lives))
            for i, life in enumerate(self.lives):
                is_first = life.name not in {other.name for other in self.lives[:i]}
                label, colour = life.name if is_first else None, f"C{names.index(life.name)}"
                axes.plot(np.array(life.t) / 60, life.rss, label=label, color=colour)
            axes.set(xlabel="minutes", ylabel="resident set, MB")
            axes.set_ylim(bottom=0.0)
            axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))
            return to_figure(plot, "Memory of every process; a gap is a kill.")


def _ends(ends: Mapping[str, int]) -> str:
    named = (f"{name}, {count} times" if count > 1 else name for name, count in ends.items())
    return "; ".join(named) or "none"


def _counted(title: str, counts: Mapping[str, int]) -> Table:
    rows: list[Cells] = [[name, count] for name, count in counts.items()]
    return Table(title, [Column("what"), Column("count", "d")], rows)
