"""Health of every sensor and of the estimate as a whole.

A sensor is "stale" when nothing usable has come from it for its latency, three sample periods and
``time_out``; samples that are not finite or not possible do not count as life, those that are older than the
latency do. It is "rejected" when the newest sample was refused, "faulty" when a watch has put it out of use.
The estimate is "degraded" when a sensor is stale, faulty, doubted by a watch, older than it should be when it
comes or refused ``reopen_after`` times in a row; "lost" when nothing has come from any for its latency and a
little more than one sample period (of fast ones ``time_out``), when an axis has not been located for
``position_time_out``, or when the tip's covariance is too large; "starting" until it was good once. Where all
who locate the axes had been at fault, it is good when all of them agree.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.estimate import SensorReport, Status
from flexarm_estimator.judging.coverage import Coverage
from flexarm_estimator.judging.sample_judge import Verdict
from flexarm_estimator.judging.sensor_record import SensorRecord, last_hope, period, report, time_out
from flexarm_estimator.judging.short_term import HELD
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.messages.tally import Tally
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.watches.watch import Finding
from flexarm_model.manipulator.sensor_spec import SensorSpec

Array = NDArray[np.float64]
_AGREED = 3  # samples in a row


class Health:
    """Counts samples, watches ages, and says whether the estimate may be used.

    Attributes:
        unknown: Samples of sensors that the description does not have.
        refusals: Samples that were refused before the filter saw them, and covariances, by sensor and reason.
        is_all_sound: No sensor is switched off or at fault.
    """

    def __init__(
        self, specs: Iterable[SensorSpec], axes: Mapping[str, Array], config: EstimatorConfig
    ) -> None:
        """Start the counts.

        Args:
            specs: Sensors of the description.
            axes: How they follow the axes, see ``MeasurementModel.axes``.
            config: Settings.
        """
        self._config, self._coverage = config, Coverage(axes)
        self._records = {
            spec.name: SensorRecord(
                spec.latency,
                period(spec),
                time_out(spec, config),
                last_hope(spec, config),
                np.zeros(len(spec.channels)),
                self._coverage.bits.get(spec.name, 0),
            )
            for spec in specs
        }
        for record in self._records.values():
            record.innovation.flags.writeable = False
        self.unknown = 0
        self.refusals = Tally()
        self.restart(0.0)

    def restart(self, t: float, is_contested: bool = False) -> None:
        """Begin anew at ``t``: ages count from here, counts go on.

        Where the axes are may be contested: then it is known when all who tell it have agreed for a while.
        """
        self._has_started, self._started, self._is_contested = False, t, is_contested
        for record in self._records.values():
            record.newest_accepted, record.newest_valid, record.delay = t, t, 0.0
            record.first_accepted = math.inf
            record.refused_in_a_row, record.accepted_before = 0, record.accepted
            record.reason = "no sample yet"
            record.faults.clear()
            record.remarks.clear()
        self._note_soundness()

    def note_refusal(self, sensor: str, reason: str) -> None:
        """Count a sample that was refused before the filter saw it."""
        self.refusals.note(sensor, reason)
        if sensor not in self._records:
            self.unknown += 1
            return
        self._records[sensor].refuse(reason)

    def note_covariance(self, sensor: str, reason: str) -> None:
        """Count a covariance that was refused; its sample is used with that of the description."""
        self.refusals.note(sensor, reason)

    def note_verdicts(self, verdicts: Iterable[Verdict], now: float) -> float:
        """Count what the gate said by ``now`` [s].

        Returns:
            The stamp of a sample that ended a silence of its sensor [s]; -inf where none did.
        """
        returned = -math.inf
        for verdict in verdicts:
            sensor, t, is_accepted, innovation, normalised, reason, _ = verdict
            record = self._records[sensor]
            record.innovation, record.normalised = innovation, normalised
            record.hear(t, now)
            if is_accepted:
                record.accepted += 1
                record.refused_in_a_row, record.reason = 0, ""
                if t > record.newest_accepted:
                    if t > record.newest_accepted + record.time_out:
                        returned = t
                    record.newest_accepted = t
                if t < record.first_accepted:
                    record.first_accepted = t
            elif reason != HELD:
                record.refuse(reason)
        return returned

    def switch(self, sensor: str, is_off: bool) -> None:
        """Switch a sensor off or on by hand.

        Raises:
            KeyError: There is no such sensor.
        """
        self._records[sensor].is_off = is_off
        self._note_soundness()

    def leave_out(self, sensor: str, channels: Iterable[str]) -> None:
        """Say of a sensor that some of its channels are switched off; none takes it back."""
        self._records[sensor].without = ", ".join(channels)

    def heed(self, finding: Finding, watch: str = "") -> None:
        """Take over what a watch says; an empty reason takes back what the same watch said."""
        record = self._records[finding.sensor]
        said = record.faults if finding.is_fault else record.remarks
        said.pop(watch, None)
        if finding.reason:
            said[watch] = finding.reason
        self._note_soundness()

    def locates(self, sensors: Iterable[str]) -> bool:
        """Return whether one of some sensors tells where the axes are."""
        return any(self._records[sensor].locates for sensor in sensors)

    def is_vouched(self, before: float) -> bool:
        """Return whether all who tell where the axes are had agreed with the state ``before`` a time [s]."""
        spoken = [r for r in self._records.values() if r.locates and r.newest_valid > self._started]
        return all(record.first_accepted < before for record in spoken)

    def is_stranded(self, t: float) -> bool:
        """Return whether whoever tells where the axes are is at fault for so long that nobody can know."""
        newest, sound = -math.inf, 0
        for record in self._records.values():
            if self._tells(record, t):
                if not record.faults:
                    sound += record.locates
                else:
                    newest = max(newest, record.newest_accepted)
        is_long = -math.inf < newest < t - self._config.position_time_out
        return is_long and not self._coverage.covers(sound)

    def pick_sound(self, samples: Iterable[Measurement]) -> list[Measurement]:
        """Return the samples of sensors that no watch has put out of use; the others are alive, too."""
        if self.is_all_sound:
            return list(samples)
        sound = []
        for sample in samples:
            record = self._records[sample.sensor]
            if not record.faults:
                sound.append(sample)
            elif sample.t > record.newest_valid:
                record.newest_valid = sample.t
        return sound

    def silence(self, sensor: str, t: float) -> float:
        """Return for how much longer than is normal a known sensor has said nothing, or was off [s]."""
        record = self._records[sensor]
        return t - (record.newest_accepted if record.is_off else record.newest_valid) - record.time_out

    def is_off(self, sensor: str) -> bool:
        """Return whether a known sensor is switched off."""
        return self._records[sensor].is_off

    def reports(self, t: float) -> tuple[SensorReport, ...]:
        """Return the health of every sensor at ``t``."""
        return tuple([report(name, record, t) for name, record in self._records.items()])

    def judge(
        self, t: float, tip_sigma: float, reports: Iterable[SensorReport], trouble: str, lost: str = ""
    ) -> tuple[Status, str]:
        """Return status and reason of the estimate.

        Args:
            t: Now [s].
            tip_sigma: One sigma of the tip's position [m].
            reports: Health of the sensors at ``t``.
            trouble: Anything else that is wrong in this step; empty when nothing is.
            lost: Why the state must not be used; empty when nothing else forbids it.
        """
        reasons = [said for said in (lost, self._why_lost(t, tip_sigma)) if said]
        if reasons:
            return ("lost" if self._has_started else "starting"), "; ".join(reasons)
        self._has_started = True
        doubts = [f"{r.name}: {r.reason}" for r in reports if r.reason and self._is_doubtful(r)]
        doubts += [trouble] if trouble else []
        return ("degraded", "; ".join(doubts)) if doubts else ("ok", "")

    def _note_soundness(self) -> None:
        self.is_all_sound = not any(record.is_off or record.faults for record in self._records.values())

    def _why_lost(self, t: float, tip_sigma: float) -> str:
        is_usable, locating = False, 0
        for record in self._records.values():
            age = math.inf if record.is_off or record.faults else t - record.newest_accepted
            is_usable |= age <= record.last_hope
            if record.locates and record.accepted:
                is_told = age <= record.time_out or age <= self._config.position_time_out
                locating += record.locates * is_told
        if not is_usable:
            return "no sensor is usable"
        if not self._coverage.covers(locating):
            return "not every axis is located" if locating else "nothing locates the axes"
        if not tip_sigma <= self._config.lost_sigma:
            return f"tip is uncertain by {tip_sigma:.2g} m"
        return self._why_contested(t) if self._is_contested else ""

    def _why_contested(self, t: float) -> str:
        """Return who has yet to agree with the others about where the axes are; empty once all have."""
        waiting = [
            name
            for name, record in self._records.items()
            if self._tells(record, t) and not record.faults and record.accepted_in_a_row < _AGREED
        ]
        self._is_contested = bool(waiting)
        return f"began anew, waits for {', '.join(waiting)} to agree" if waiting else ""

    def _tells(self, record: SensorRecord, t: float) -> bool:
        """Return whether a sensor speaks, and of where the axes are."""
        return record.locates > 0 and not record.is_off and not record.is_silent(t)

    def _is_doubtful(self, report: SensorReport) -> bool:
        if report.status == "rejected":
            return self._records[report.name].refused_in_a_row >= self._config.reopen_after
        return report.status in ("stale", "faulty") or bool(self._records[report.name].remark)
