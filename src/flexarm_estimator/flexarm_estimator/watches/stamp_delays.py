"""How late the stamps of the sensors are, as configured or as found out, and the samples at their own time.

A driver that stamps a frame when it arrives stamps it by its latency too late. The delay of a sensor is
stamp minus instant of the sample; samples are moved back by it before anything else looks at them.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from flexarm_estimator.measurement import Measurement
from flexarm_model.manipulator.sensor_spec import SensorSpec


class StampDelays:
    """Delay of every sensor's stamps [s], the one in use and the configured one."""

    def __init__(self, specs: Iterable[SensorSpec]) -> None:
        """Begin with the delays of the description."""
        self._configured = {spec.name: spec.stamp_delay for spec in specs}
        self.restart()

    def restart(self) -> None:
        """Go back to the configured delays."""
        self._changed = {name: delay for name, delay in self._configured.items() if delay}

    @property
    def in_use(self) -> dict[str, float]:
        """Those that are not zero, by sensor [s]."""
        return dict(self._changed)

    def of(self, sensor: str) -> float:
        """Return the delay in use [s]; zero for a sensor that does not exist."""
        return self._changed.get(sensor, 0.0)

    def use(self, sensor: str, delay: float) -> None:
        """Use another delay [s] from the next sample on."""
        self._changed[sensor] = delay

    def resume(self, delays: Mapping[str, float]) -> None:
        """Use what was ``in_use`` before."""
        self._changed = dict(delays)

    def undo(self, samples: Sequence[Measurement]) -> Sequence[Measurement]:
        """Return the samples at the instants at which they were taken."""
        changed = self._changed
        if not changed:
            return samples
        return [s._replace(t=s.t - changed[s.sensor]) if s.sensor in changed else s for s in samples]
