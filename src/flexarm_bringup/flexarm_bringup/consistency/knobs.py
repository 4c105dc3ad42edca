"""What can be tuned: settings of the process and sigmas of the sensors, each a factor that stays positive."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.manipulator.sensor_spec import SensorSpec

Array = NDArray[np.float64]
Verdict = Literal["told", "less", "more", "flat"]
PROCESS = ("acceleration_noise", "disturbance_drift", "motion_acceleration", "modal_force")
SAG = "sag_error"  # where static deflections are states
LARGEST = float(np.log(100.0))  # change of a parameter


@dataclass(frozen=True)
class Noise:
    """Settings of the process and sigmas of the sensors.

    Attributes:
        settings: Of the estimator.
        sensors: With their sigmas.
    """

    settings: EstimatorConfig
    sensors: tuple[SensorSpec, ...]


@dataclass(frozen=True)
class Parameter:
    """Something that is tuned.

    Attributes:
        name: Of the setting, or of the sensors that share a sigma.
        unit: Of its value.
        before: Value (of sensors that of the first channel).
        after: Where the search ended; the value before where the record does not tell it.
        spread: One sigma of the logarithm [1].
        verdict: "told" by the record; "less", "more": only that it is so than before, proposed as well;
            "flat": the record is as likely with the value before, which was put back.
    """

    name: str
    unit: str
    before: float
    after: float
    spread: float
    verdict: Verdict


@dataclass(frozen=True)
class Knob:
    """A parameter that can be turned.

    Attributes:
        name, unit, value: As it is.
        limits: Of the logarithm of the factor.
        sensors: Those whose sigma it scales; none for a setting.
    """

    name: str
    unit: str
    value: float
    limits: tuple[float, float]
    sensors: tuple[str, ...] = ()

    def is_inside(self, change: float) -> bool:
        """Return whether a logarithm is not at its limit."""
        return self.limits[0] < change < self.limits[1]

    def parameter(self, change: float, spread: float, verdict: Verdict) -> Parameter:
        """Return what it became: the logarithm of its factor, and one sigma of that."""
        return Parameter(
            self.name, self.unit, self.value, self.value * float(np.exp(change)), spread, verdict
        )


def make_knobs(noise: Noise, own: Collection[str] = ()) -> list[Knob]:
    """Return what can be tuned; sensors of one kind with one sigma share a knob.

    Args:
        noise: As it is.
        own: Sensors whose samples bring a covariance of their own: they have no knob.
    """
    allowed = {item.name: item.metadata for item in fields(EstimatorConfig)}
    names = (*PROCESS, SAG) if noise.settings.sag_modes else PROCESS
    knobs = []
    for name in names:
        value, meta = float(getattr(noise.settings, name)), allowed[name]
        low, high = np.log(meta["minimum"] / value), np.log(meta["maximum"] / value)
        knobs.append(Knob(name, meta["unit"], value, (max(low, -LARGEST), min(high, LARGEST))))
    alike: dict[tuple[str, tuple[float, ...]], list[str]] = {}
    for spec in noise.sensors:
        if spec.name in own:
            continue
        alike.setdefault((spec.kind, tuple(spec.sigma.tolist())), []).append(spec.name)
    for (kind, sigma), sensors in alike.items():
        title = ", ".join(sensors)
        knobs.append(Knob(title, _UNITS.get(kind, ""), float(sigma[0]), (-LARGEST, LARGEST), tuple(sensors)))
    return knobs


def turn(noise: Noise, knobs: Sequence[Knob], p: Array) -> Noise:
    """Return noise with every knob's value times ``exp(p)``, p (len(knobs),)."""
    factors = np.exp(p)
    settings: dict[str, float] = {}
    sensors: dict[str, float] = {}
    for knob, factor in zip(knobs, factors, strict=True):
        if knob.sensors:
            sensors.update({name: float(factor) for name in knob.sensors})
        else:
            settings[knob.name] = float(knob.value * factor)
    specs = tuple(replace(spec, sigma=spec.sigma * sensors.get(spec.name, 1.0)) for spec in noise.sensors)
    return Noise(_changed(noise.settings, settings), specs)


def _changed(settings: EstimatorConfig, values: Mapping[str, float]) -> EstimatorConfig:
    return replace(settings, **values)  # type: ignore[arg-type]  # all of them are numbers


_UNITS = {
    "encoder": "rad or m",
    "strain_gauge": "1",
    "accelerometer": "m/s^2",
    "gyroscope": "rad/s",
    "camera": "m (and rad)",
}
