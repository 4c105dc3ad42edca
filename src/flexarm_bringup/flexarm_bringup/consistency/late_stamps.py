"""How late the cameras of a bag stamp, as the estimator finds out on the way.

A frame that counts at another instant than its own is off by what the tip has moved since: a likelihood would
take that for the camera's noise.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from flexarm_bringup.page.check import Check
from flexarm_estimator.watches.stamp_alarm import is_drift
from flexarm_model.manipulator.sensor_spec import SensorSpec

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


def late_stamps(figures: Mapping[str, Mapping[str, float]], specs: Iterable[SensorSpec]) -> list[LateStamps]:
    """Return how late the cameras stamp; those of which nothing was found out are left out.

    Args:
        figures: Of the estimator at the end of a bag, by sensor and name.
        specs: The sensors.
    """
    return [
        LateStamps(
            spec.name,
            spec.stamp_delay,
            figures[spec.name]["stamp delay found [s]"],
            figures[spec.name]["its one sigma [s]"],
        )
        for spec in specs
        if "stamp delay found [s]" in figures.get(spec.name, {})
    ]


def delays_in_use(late: Sequence[LateStamps], is_calibrated: bool) -> dict[str, float]:
    """Return the delays [s] that an estimator undoes in the end: those found, where it calibrates."""
    return {each.camera: each.found for each in late} if is_calibrated else {}
