"""What the estimator holds of the sensors, from its states and from what a user did to it.

A sensor that is switched off or at fault says nothing of the arm. One that is refused time and again or
remarked upon is doubted. Fault and doubt last for a while after their cause: a fault shows in some moves and
not in others, and the watch still remembers what a doubtful sensor said.
"""

from __future__ import annotations

from typing import Any

from flexarm_estimator.conversions import state_from_msg
from flexarm_estimator.drift.opinion import OFF, Opinion
from flexarm_estimator.estimate import SensorReport
from flexarm_estimator.interventions.conversions import intervention_from_msg
from flexarm_estimator.interventions.intervention import InterventionError
from flexarm_estimator.interventions.toggle_sensor import ToggleSensor
from flexarm_model.conversions import NS_PER_S, stamp_to_ns

REFUSED = 5  # states in a row in which a sensor was refused: it is no spike
LASTING = 5.0  # s that fault and doubt outlive their cause


class OpinionReader:
    """Reads states, some ten a second, and interventions of the estimator.

    Attributes:
        opinion: As of now; another object when it has changed.
    """

    def __init__(self) -> None:
        """Begin with all sensors in use."""
        self.opinion = Opinion()
        self._off: tuple[str, ...] = ()
        self._channels: dict[str, tuple[str, ...]] = {}
        self._faults: dict[str, tuple[int, str]] = {}  # stamp until which [ns], and what
        self._doubts: dict[str, tuple[int, str]] = {}  # the same
        self._refused: dict[str, int] = {}  # states in a row

    def on_intervention(self, msg: Any) -> None:
        """Take what a user did to channels, which outlives the estimator; of whole sensors states tell."""
        try:
            done = intervention_from_msg(msg)
        except InterventionError:  # of another version; the estimator tells of it
            return
        if isinstance(done, ToggleSensor) and done.channels:
            self._switch(done)
            self._tell()

    def on_state(self, msg: Any) -> None:
        """Take the health in a state of the estimator; one that does not fit together says nothing."""
        try:
            _, _, status, reports = state_from_msg(msg)
        except ValueError:
            return
        now_ns = stamp_to_ns(msg.header.stamp)
        self._off = tuple(report.name for report in reports if report.status == "off")
        until_ns = now_ns + round(LASTING * NS_PER_S)
        for report in reports:
            is_doubtful = self._is_doubtful(report, status == "degraded")
            if report.status == "faulty" or is_doubtful:
                said = self._doubts if is_doubtful else self._faults
                why = report.reason if is_doubtful else f"at fault: {report.reason}"
                said[report.name] = until_ns, said.get(report.name, (0, why))[1]  # its numbers change
        for said in (self._faults, self._doubts):
            for name in [name for name, (at, _) in said.items() if not now_ns <= at <= until_ns]:
                del said[name]  # it is over, or the clock was set back
        self._tell()

    def _is_doubtful(self, report: SensorReport, is_degraded: bool) -> bool:
        """Return whether a sensor is refused time and again, or a watch remarks upon it."""
        refused = self._refused.get(report.name, 0) + 1 if report.status == "rejected" else 0
        self._refused[report.name] = refused
        is_remarked = report.status == "ok" and bool(report.reason) and report.name not in self._channels
        return refused >= REFUSED or (is_degraded and is_remarked)

    def _switch(self, done: ToggleSensor) -> None:
        off = set(self._channels.pop(done.sensor, ()))
        off = off - set(done.channels) if done.is_on else off | set(done.channels)
        if off:
            self._channels[done.sensor] = tuple(sorted(off))

    def _tell(self) -> None:
        unused = {name: why for name, (_, why) in self._faults.items()} | dict.fromkeys(self._off, OFF)
        doubted = {name: why for name, (_, why) in self._doubts.items() if name not in unused}
        now = Opinion(unused, dict(self._channels), doubted)
        if now != self.opinion:
            self.opinion = now
