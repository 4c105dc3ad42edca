"""Settings of the excite node, and the wish that follows from them."""

from __future__ import annotations

from dataclasses import dataclass

from flexarm_bringup.excite.plan import Wish
from flexarm_model.identification.excitation import SIGNALS
from flexarm_model.settings.arm_settings import LoopSettings
from flexarm_model.settings.parameters import ParameterError, parameter


@dataclass(frozen=True)
class ExciteSettings(LoopSettings):
    """Settings of the excite node."""

    pose: tuple[float, ...] = parameter((), "Axes where the arm stands and is held; empty: home.", "rad or m")
    signal: str = parameter("multisine", "What is added to the torque.", choices=tuple(SIGNALS))
    band: tuple[float, ...] = parameter(
        (), "Lowest and highest frequency; empty: from the model.", "Hz", 0.0, 1e5
    )
    resolution: float = parameter(
        0.0, "Distance of the lines, the inverse of a period; 0: from the model.", "Hz", 0.0, 100.0
    )
    periods: int = parameter(Wish.periods, "Periods recorded per run.", minimum=1, maximum=1000)
    share: float = parameter(
        Wish.share, "Of torque, strain, speed and range limits that the model may predict.", "1", 0.001, 1.0
    )
    ignore: tuple[str, ...] = parameter((), "Channels or sensors that may be wrong and are left out.")
    partners: tuple[str, ...] = parameter(("model", "guard", "rig"), "Nodes to wait for.")
    patience: float = parameter(60.0, "Longest wait without any progress.", "s", 1.0, 3600.0)


def wish_of(settings: ExciteSettings) -> Wish:
    """Return what is asked for.

    Raises:
        ParameterError: The band has not two ends.
    """
    if len(settings.band) not in (0, 2):
        raise ParameterError(f"band: {len(settings.band)} values; expected lowest and highest frequency [Hz]")
    band = (settings.band[0], settings.band[1]) if settings.band else None
    return Wish(settings.signal, band, settings.resolution or None, settings.periods, settings.share)
