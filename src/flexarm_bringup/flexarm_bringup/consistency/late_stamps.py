"""How late the cameras of a bag stamp, as the estimator finds out on the way.

A frame that counts at another instant than its own is off by what the tip has moved since: a likelihood would
take that for the camera's noise.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from flexarm_bringup.consistency.recording import NoController, Recording
from flexarm_bringup.page.check import Check
from flexarm_bringup.replaying.player import Player
from flexarm_estimator.exchange import EstimatorExchange
from flexarm_estimator.watches.stamp_alarm import is_drift

MS = 1e3


@dataclass(frozen=True)
class LateStamps:
    """How late a camera's stamps are [s].

    Attributes:
        camera: Which.
        configured: By its ``stamp_delay``.
        found, sigma: By comparison with encoders and gauges, at the end of the bag.
    """

    camera: str
    configured: float
    found: float
    sigma: float

    def check(self, in_use: Mapping[str, float]) -> Check:
        """Return whether they are as late as they are taken to be: ``in_use`` [s], else as configured."""
        used = in_use.get(self.camera, self.configured)
        found = f"{MS * self.found:.1f} ms late (one sigma {MS * self.sigma:.1f} ms)"
        is_kept = not is_drift(self.found - used, self.sigma)
        return Check(f"stamps of {self.camera}", f"as late as is undone, {MS * used:.1f} ms", found, is_kept)

    def describe(self) -> str:
        """Return that the frames count at the instants that were found."""
        return f"frames of {self.camera} count {MS * self.found:.1f} ms before their stamp, as calibrated"


def find_late_stamps(recording: Recording) -> list[LateStamps]:
    """Return how late the cameras stamp; those of which the bag does not tell it are left out."""
    exchange = EstimatorExchange(recording.config, recording.settings, recording.epoch_ns, recording.config)
    for _ in Player(exchange, NoController(), recording.lockstep).play(recording.bag.records):
        pass
    figures = exchange.estimator.figures() if exchange.estimator is not None else {}
    return [
        LateStamps(
            spec.name,
            spec.stamp_delay,
            figures[spec.name]["stamp delay found [s]"],
            figures[spec.name]["its one sigma [s]"],
        )
        for spec in recording.config.sensors
        if "stamp delay found [s]" in figures.get(spec.name, {})
    ]


def delays_in_use(late: Sequence[LateStamps], is_calibrated: bool) -> dict[str, float]:
    """Return the delays [s] that an estimator undoes in the end: those found, where it calibrates."""
    return {each.camera: each.found for each in late} if is_calibrated else {}
