"""Reception: which of the samples that arrive are fused now, which a little later, and which never."""

from __future__ import annotations

from collections.abc import Sequence
from operator import attrgetter
from typing import NamedTuple

from flexarm_estimator.judging.checks import SampleChecks, Window
from flexarm_estimator.judging.health import Health
from flexarm_estimator.judging.scan import Scan, split_newest
from flexarm_estimator.judging.switched_channels import Narrowing
from flexarm_estimator.measurement import SAME_INSTANT, Measurement
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.manipulator.sensor_spec import SensorSpec

_STAMP = attrgetter("t")
_FEWEST = 3  # samples that are cheaper to look at together than one by one


class Arrivals(NamedTuple):  # not a dataclass: made in every step
    """Samples that may be fused now.

    Attributes:
        all: In order of time.
        scan: Those that belong together; None where none do.
        singles: The others, in order of time.
    """

    all: Sequence[Measurement]
    scan: Scan | None
    singles: list[Measurement]


class Reception:
    """Checks samples and keeps those that are a little early."""

    def __init__(self, specs: tuple[SensorSpec, ...], config: EstimatorConfig, health: Health) -> None:
        """Start with nothing kept; ``health`` is told what is refused."""
        self._checks, self._config, self._health = SampleChecks(specs), config, health
        self._narrowing = Narrowing(specs)
        self._early: list[Measurement] = []

    def retune(self, specs: tuple[SensorSpec, ...], config: EstimatorConfig) -> None:
        """Go on with other noise of the same sensors."""
        self._checks.retune(specs)
        self._config = config

    def admit(self, measurements: Sequence[Measurement], t: float, oldest: float) -> Arrivals:
        """Return the samples that may be fused now; count the others.

        Args:
            measurements: What has arrived.
            t: Now [s].
            oldest: Samples up to then cannot be fused any more [s].
        """
        scan, measurements = None, self._narrowing.narrow(measurements)
        if len(measurements) >= _FEWEST and self._health.is_all_sound:
            scan, measurements = self._take_scan(measurements, oldest, t + SAME_INSTANT)
            if scan is not None and not (measurements or self._early):
                return Arrivals(scan.samples, scan, [])
        singles = self._admit_singly(measurements, t, oldest)
        if scan is None:
            return Arrivals(singles, None, singles)
        return Arrivals(sorted([*singles, *scan.samples], key=_STAMP), scan, singles)

    def _take_scan(
        self, measurements: Sequence[Measurement], oldest: float, newest: float
    ) -> tuple[Scan | None, Sequence[Measurement]]:
        """Return all samples, else the newest of them, as a scan where they are one, and those left."""
        if measurements[0].t == measurements[-1].t:
            scan = self._checks.take_scan(measurements, oldest, newest)
            if scan is not None:
                return scan, ()
        together, others = split_newest(measurements)
        scan = self._checks.take_scan(together, oldest, newest) if together and others else None
        return (None, measurements) if scan is None else (scan, others)

    def _admit_singly(
        self, measurements: Sequence[Measurement], t: float, oldest: float
    ) -> list[Measurement]:
        """Return the samples that may be fused now, those that waited for it, too, in order of time."""
        now = t + SAME_INSTANT
        due: list[Measurement] = []
        if self._early:
            due = [sample for sample in self._early if sample.t <= now]
            self._early = [sample for sample in self._early if sample.t > now]
        window = Window(oldest, now + self._config.future_tolerance)
        checks, health = self._checks, self._health
        is_any_off = not health.is_all_sound
        for sample in measurements:
            sensor, stamp, _, R = sample
            reason = checks.refuse(sample, window)
            if reason:
                health.note_refusal(sensor, reason)
            elif not (is_any_off and health.is_off(sensor)):
                if R is not None or checks.is_at_end:
                    sample = self._with_noise(sample)
                (due if stamp <= now else self._early).append(sample)
        due.sort(key=_STAMP)
        return due

    def _with_noise(self, sample: Measurement) -> Measurement:
        """Return a sample with the noise to reckon with; count a covariance that is none."""
        R = self._checks.noise(sample)
        if self._checks.covariance_fault:
            self._health.note_covariance(sample.sensor, self._checks.covariance_fault)
        return sample._replace(R=R)
