"""The kinds of sensor: how each is written in the YAML.

What a sensor measures of the moving arm is in ``tree.sensors``; a new kind is one entry here and one there.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from flexarm_model.manipulator.description import Axis
from flexarm_model.manipulator.gauge_bridge import read_output
from flexarm_model.manipulator.sensor_spec import BiasSpec, SensorSpec
from flexarm_model.settings.strict_yaml import Section
from flexarm_model.settings.units import axis_dimension, si_unit

TRANSLATION, ROTATION = ("tx", "ty", "tz"), ("rx", "ry", "rz")
POSE_CHANNELS = TRANSLATION + ROTATION
POSE_UNITS = dict(zip(POSE_CHANNELS, ("m", "m", "m", "rad", "rad", "rad"), strict=True))
_FAR = 10.0  # no arm reaches this far [m], no rotation vector is that long [rad]
_MANY_TURNS = 100.0  # rad or m; an encoder of an axis without limits may count on
_STAMP_DELAY = (-0.1, 1.0)  # what a driver's stamps may be late; a clock that is further off must be set [s]


@dataclass(frozen=True)
class SensorKind:
    """How a kind of sensor is read.

    Attributes:
        site: Where it sits: "axis" of a joint, "node" of a body, or "tip" (it watches the tool).
        units: SI unit of each of its possible channels, for a site.
        read: Reads the rest of its YAML: name, site, section; with the axis that it measures if it does.
        misfit: Returns why some of its channels cannot be without the others; empty when they can.
        locates: It tells where axes are even if nothing bends; what else reads positions reads how the arm
            bends, under its weight, too, which is another at each pose.
    """

    site: str
    units: Callable[[str], dict[str, str]]
    read: Callable[[str, str, Section, Axis | None], SensorSpec]
    locates: bool = False
    misfit: Callable[[tuple[str, ...]], str] = lambda channels: ""


def _encoder(name: str, site: str, section: Section, axis: Axis | None) -> SensorSpec:
    assert axis is not None
    position = axis_dimension(site, "position")
    sigma = section.quantity("sigma", position, above=0.0)
    low, high = np.clip(axis.possible, -_MANY_TURNS, _MANY_TURNS).tolist()
    low, high = section.quantity("low", position, low), section.quantity("high", position, high)
    if not low < high:
        key, other = ("high", f"low, {low:.6g}") if section.has("high") else ("low", f"high, {high:.6g}")
        side = "above" if key == "high" else "below"
        raise section.error(key, section.take(key), f"must be {side} {other} {si_unit(position)}")
    _refuse_drowned(section, sigma, (high - low) / 2, position)
    timing, bias = _timing(section), _bias(section, position)
    return SensorSpec(
        name, "encoder", site, ("position",), np.array([sigma]), *timing, low, high,
        bias=bias, velocity=axis.velocity,
    )  # fmt: skip


def _strain_gauge(name: str, site: str, section: Section, _: Axis | None) -> SensorSpec:
    sigma = section.quantity("sigma", "strain", above=0.0)
    reach = section.quantity("range", "strain", 0.02, above=0.0)  # foil gauges end at about 2 %
    _refuse_drowned(section, sigma, reach, "strain")
    limit = section.quantity("limit", "strain", math.inf, above=0.0)
    y, z = section.quantities("offset", ["length"] * 2)
    return SensorSpec(
        name,
        "strain_gauge",
        site,
        ("strain",),
        np.array([sigma]),
        *_timing(section),
        -reach,
        reach,
        (y, z),
        limit,
        bias=_bias(section, "strain"),
        output=read_output(section),
    )


def _inertial(kind: str, dimension: str) -> Callable[[str, str, Section, Axis | None], SensorSpec]:
    """Return what reads a part of an inertial measurement unit."""

    def read(name: str, site: str, section: Section, _: Axis | None) -> SensorSpec:
        """Read the sensor; ``imu`` names the unit that carries it."""
        sigma = section.quantity("sigma", dimension, above=0.0)
        reach = section.quantity("range", dimension, above=0.0)
        _refuse_drowned(section, sigma, reach, dimension)
        axes = section.choices("axes", ("x", "y", "z"), at_least=1)
        timing, bias, imu = _timing(section), _bias(section, dimension), section.text("imu", "")
        noise = np.full(len(axes), sigma)
        return SensorSpec(name, kind, site, axes, noise, *timing, -reach, reach, bias=bias, imu=imu)

    return read


def _camera(name: str, site: str, section: Section, _: Axis | None) -> SensorSpec:
    """Read what sees the tip: its pose, or of it what ``axes`` names; a laser tracker sees no rotation."""
    axes = section.choices("axes", POSE_CHANNELS, POSE_CHANNELS, at_least=1)
    if misfit := _camera_misfit(axes):
        raise section.error("axes", list(axes), misfit)
    places, turns = ([axis for axis in axes if axis in part] for part in (TRANSLATION, ROTATION))
    position = section.quantity("sigma", "length", above=0.0)
    angle = section.quantity("sigma_angle", "angle", above=0.0) if turns else 0.0
    sigma = np.array([position] * len(places) + [angle] * len(turns))
    topic = section.text("topic", "")
    return SensorSpec(name, "camera", site, axes, sigma, *_timing(section), -_FAR, _FAR, topic=topic)


def _camera_misfit(axes: tuple[str, ...]) -> str:
    """Return why a camera cannot see these axes of a pose alone; empty when it can."""
    places, turns = ([axis for axis in axes if axis in part] for part in (TRANSLATION, ROTATION))
    if places and len(turns) in (0, len(ROTATION)):
        return ""
    return f"expected some of {', '.join(TRANSLATION)}; and {', '.join(ROTATION)} all together or none"


def _refuse_drowned(section: Section, sigma: float, reach: float, dimension: str) -> None:
    """Raise ConfigError where one sigma of the noise fills the range to either side."""
    if not sigma < reach:
        allowed = f"must be below the range, {reach:.6g} {si_unit(dimension)}: nothing but noise fits into it"
        raise section.error("sigma", section.take("sigma"), allowed)


def read_stamp_delay(section: Section) -> float:
    """Read how much later than its sample the stamps of any sensor are [s]."""
    low, high = _STAMP_DELAY
    delay = section.quantity("stamp_delay", "time", 0.0)
    if not low <= delay <= high:
        text = f"stamp minus instant of the sample, must be from {low * 1e3:g} ms to {high * 1e3:g} ms"
        raise section.error("stamp_delay", section.take("stamp_delay"), text)
    return delay


def _timing(section: Section) -> tuple[float, float]:
    """Read rate [Hz] and latency [s]."""
    rate_hz = section.quantity("rate", "frequency", 0.0, above=0.0)
    return rate_hz, section.quantity("latency", "time", 0.0, at_least=0.0)


def _bias(section: Section, dimension: str) -> BiasSpec | None:
    """Read what a sensor may be off by; a sensor without the key has no bias."""
    if not section.has("bias"):
        return None
    inner = section.section("bias")
    bias = BiasSpec(
        sigma=inner.quantity("sigma", dimension, above=0.0),
        drift=inner.quantity("drift", f"{dimension} drift", at_least=0.0),
        limit=inner.quantity("limit", dimension, above=0.0),
        rate=inner.quantity("rate", f"{dimension} rate", BiasSpec.rate, at_least=0.0),
        rate_time=inner.quantity("rate_time", "time", BiasSpec.rate_time, above=0.0),
    )
    if not bias.sigma <= bias.limit:
        raise inner.error("limit", inner.take("limit"), "must be at least one sigma")
    inner.done()
    return bias


def _encoder_units(site: str) -> dict[str, str]:
    return {"position": si_unit(axis_dimension(site, "position"))}


SENSOR_KINDS: dict[str, SensorKind] = {
    "encoder": SensorKind("axis", _encoder_units, _encoder, locates=True),
    "strain_gauge": SensorKind("node", lambda site: {"strain": "1"}, _strain_gauge),
    "accelerometer": SensorKind(
        "node", lambda site: dict.fromkeys("xyz", "m/s^2"), _inertial("accelerometer", "acceleration")
    ),
    "gyroscope": SensorKind(
        "node", lambda site: dict.fromkeys("xyz", "rad/s"), _inertial("gyroscope", "angular velocity")
    ),
    "camera": SensorKind("tip", lambda site: POSE_UNITS, _camera, locates=True, misfit=_camera_misfit),
}
