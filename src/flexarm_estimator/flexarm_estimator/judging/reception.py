"""Reception: which of the samples that arrive are fused now, which a little later, and which never."""

from __future__ import annotations

from collections.abc import Sequence
from operator import attrgetter

from flexarm_estimator.history import SAME_INSTANT
from flexarm_estimator.judging.checks import SampleChecks, Window
from flexarm_estimator.judging.health import Health
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.manipulator.sensor_spec import SensorSpec

_STAMP = attrgetter("t")


class Reception:
    """Checks samples and keeps those that are a little early."""

    def __init__(self, specs: tuple[SensorSpec, ...], config: EstimatorConfig, health: Health) -> None:
        """Start with nothing kept; ``health`` is told what is refused."""
        self._checks, self._config, self._health = SampleChecks(specs), config, health
        self._early: list[Measurement] = []

    def retune(self, specs: tuple[SensorSpec, ...], config: EstimatorConfig) -> None:
        """Go on with other noise of the same sensors."""
        self._checks.retune(specs)
        self._config = config

    def admit(self, measurements: Sequence[Measurement], t: float, oldest: float) -> list[Measurement]:
        """Return the samples that may be fused now, in order of time; count the others.

        Args:
            measurements: What has arrived.
            t: Now [s].
            oldest: Samples up to then cannot be fused any more [s].
        """
        now = t + SAME_INSTANT
        due: list[Measurement] = []
        if self._early:
            due = [sample for sample in self._early if sample.t <= now]
            self._early = [sample for sample in self._early if sample.t > now]
        window = Window(oldest, now + self._config.future_tolerance)
        checks, health = self._checks, self._health
        for sample in measurements:
            sensor, t, _, R = sample
            reason = checks.refuse(sample, window)
            if reason:
                health.note_refusal(sensor, reason)
            elif not health.is_off(sensor):
                if R is not None or checks.is_at_end:
                    sample = sample._replace(R=checks.noise(sample))
                (due if t <= now else self._early).append(sample)
        due.sort(key=_STAMP)
        return due
