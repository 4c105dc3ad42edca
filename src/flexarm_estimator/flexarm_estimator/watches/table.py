"""The watches of an estimator, in the order in which they look."""

from __future__ import annotations

from collections.abc import Callable

from flexarm_estimator.isolation.isolation_watch import IsolationWatch
from flexarm_estimator.parts import Parts
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.watches.bias_watch import BiasWatch
from flexarm_estimator.watches.frozen_watch import FrozenWatch
from flexarm_estimator.watches.latency_watch import LatencyWatch
from flexarm_estimator.watches.noise_watch import NoiseWatch
from flexarm_estimator.watches.offset_watch import OffsetWatch
from flexarm_estimator.watches.shift_watch import ShiftWatch
from flexarm_estimator.watches.stamp_delays import StampDelays
from flexarm_estimator.watches.watch import Finding, View, Watch
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.tree.closure_error import ClosureError


class Watches:
    """All watches of one estimator.

    Attributes:
        all: In the order in which they look.
    """

    def __init__(self, specs: tuple[SensorSpec, ...], config: EstimatorConfig, delays: StampDelays) -> None:
        """Make new ones.

        Args:
            specs: The sensors.
            config: Settings.
            delays: Of the stamps, in use.
        """
        self.all: tuple[Watch, ...] = (
            FrozenWatch(),
            ShiftWatch(config.gate),
            LatencyWatch(delays, config),
            BiasWatch(specs, config),
            NoiseWatch(specs),
            OffsetWatch(),
            IsolationWatch(specs, {"strain_gauge": config.isolation_strain_error}),
        )

    def use(self, parts: Parts) -> None:
        """Go on with the parts of another model."""
        for watch in self.all:
            watch.use(parts)

    def retune(self, specs: tuple[SensorSpec, ...]) -> None:
        """Go on with other noise of the same sensors."""
        for watch in self.all:
            watch.retune(specs)

    def restart(self, t: float) -> None:
        """Forget everything at ``t`` [s]."""
        for watch in self.all:
            watch.restart(t)

    def look(self, view: View, heed: Callable[[Finding, str], None]) -> list[Finding]:
        """Return what all have found; every finding goes to ``heed`` at once, with the name of the watch."""
        findings: list[Finding] = []
        for watch in self.all:
            try:
                said = watch.look(view)
            except ClosureError:  # the state is where no pose can be predicted: nothing can be compared
                watch.restart(view.t)
                continue
            for finding in said:
                heed(finding, type(watch).__name__)
                findings.append(finding)
        return findings

    def figures(self) -> dict[str, dict[str, float]]:
        """Return what they can tell in numbers, by sensor and name with unit ("latency [s]")."""
        figures: dict[str, dict[str, float]] = {}
        for watch in self.all:
            for sensor, values in watch.values().items():
                figures.setdefault(sensor, {}).update(values)
        return figures
