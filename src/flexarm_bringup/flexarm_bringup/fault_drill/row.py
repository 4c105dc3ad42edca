"""A row of the fault matrix, and what makes most of them: faults of sensors and a list of measures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from flexarm_bringup.fault_drill.findings import Finding, Measure, Trial
from flexarm_bringup.fault_drill.stand import FAULT_END, FAULT_START, Bench, Skipped
from flexarm_bringup.sim.sensor_faults import SensorFault

Play = Callable[[Any], Sequence[Finding]]  # of a Stand; what is made of cases takes any Bench
Choice = Callable[[Bench], tuple[str, ...]]


@dataclass(frozen=True)
class Row:
    """One row.

    Attributes:
        number: Of the row.
        fault: What is injected.
        expected: What must happen.
        play: Injects it and measures; raises ``Skipped`` where that is not possible.
        kind: "L" in one process, "N" with nodes, "R" with nodes and as root.
    """

    number: int
    fault: str
    expected: str
    play: Play
    kind: str = "L"


@dataclass(frozen=True)
class Case:
    """One run: which sensors have which fault, and what is measured.

    Attributes:
        choose: Sensors at fault.
        fault: What is wrong with each of them; its times are those of the drill.
        measures: What is measured.
        label: Tells it from other runs of the row.
        end: When the fault ends, or the measurement where it lasts for the whole run [s].
        throughout: The fault is there for the whole run.
    """

    choose: Choice
    fault: SensorFault
    measures: tuple[Measure, ...]
    label: str = ""
    end: float = FAULT_END
    throughout: bool = False

    def play(self, stand: Bench) -> list[Finding]:
        """Run it; nothing where the machine has no such sensor."""
        names = self.choose(stand)
        if not names:
            return []
        fault = self.fault if self.throughout else replace(self.fault, start=FAULT_START, end=self.end)
        trace = stand.play(dict.fromkeys(names, fault))
        trial = Trial(stand, trace, names, FAULT_START, self.end, self.label)
        return [measure(trial) for measure in self.measures]


def every(*kinds: str) -> Choice:
    """Choose all sensors of some kinds: their amplifier or driver is at fault."""
    return lambda stand: tuple(spec.name for spec in stand.of_kind(*kinds))


def one(kind: str) -> Choice:
    """Choose the first sensor of a kind: itself or its plug is at fault."""
    return lambda stand: tuple(spec.name for spec in stand.of_kind(kind)[:1])


def cases(*todo: Case) -> Play:
    """Return what plays several runs, one after the other."""

    def play(stand: Bench) -> list[Finding]:
        """Play the cases that the stand has sensors for."""
        findings = [finding for case in todo for finding in case.play(stand)]
        if not findings:
            raise Skipped("the machine has no such sensor")
        return findings

    return play


def together(*plays: Play) -> Play:
    """Return what plays several parts of a row, one after the other."""
    return lambda stand: [finding for play in plays for finding in play(stand)]
