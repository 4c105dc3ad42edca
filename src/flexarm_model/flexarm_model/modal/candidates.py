"""Sensors that could be mounted: copies of a prototype at every node of every body and at every axis.

A prototype is a mounted sensor, or one that the caller holds in the hand. It measures on all its
channels, so an accelerometer with one axis is also tried along the other two. A sensor with an offset
from the beam's axis (a gauge) belongs to its own body's section and stays there; an encoder is tried at the
axes that have none.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from flexarm_model.manipulator.body_spec import Beam
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.sensor_kinds import SENSOR_KINDS
from flexarm_model.manipulator.sensor_spec import SensorSpec

STRAIN = "strain"  # a channel that only beams have


def candidate_config(config: ManipulatorConfig, extra: Iterable[SensorSpec] = ()) -> ManipulatorConfig:
    """Return the arm with all sensors that could be mounted instead of those that are.

    Linearising it about the same pose gives rows in the same coordinates.

    Args:
        config: The description.
        extra: Prototypes beside the mounted sensors, at any node.
    """
    prototypes = (*config.sensors, *extra)
    found: dict[tuple[object, ...], SensorSpec] = {}
    for copy in (*_at_nodes(config, prototypes), *_at_axes(config, prototypes)):
        found.setdefault((copy.kind, copy.site, copy.offset), copy)
    sensors = tuple(found.values())
    return replace(config, sensors=sensors, config_id=f"{config.config_id}-candidates")


def noise(config: ManipulatorConfig) -> dict[str, float]:
    """Return the noise of every row "sensor.channel" of a description, SI."""
    return {
        f"{sensor.name}.{channel}": float(sigma)
        for sensor in config.sensors
        for channel, sigma in zip(sensor.channels, sensor.sigma, strict=True)
    }


def sample_rates(config: ManipulatorConfig) -> dict[str, float]:
    """Return the samples per second of every row "sensor.channel" of a description [Hz]."""
    return {
        f"{sensor.name}.{channel}": sensor.rate_hz or config.rate_hz
        for sensor in config.sensors
        for channel in sensor.channels
    }


def _at_nodes(config: ManipulatorConfig, prototypes: Iterable[SensorSpec]) -> Iterator[SensorSpec]:
    """Yield copies of what sits at a node, at every node."""
    nodes = [(body, node) for body in config.bodies.values() for node in body.nodes]
    for prototype in prototypes:
        if SENSOR_KINDS[prototype.kind].site == "node":
            own = prototype.site.split(".")[0]
            for body, node in nodes:
                fits = isinstance(body, Beam) or STRAIN not in prototype.channels
                if fits and (body.name == own or not any(prototype.offset)):
                    yield _copy(prototype, f"{body.name}.{node}")


def _at_axes(config: ManipulatorConfig, prototypes: Iterable[SensorSpec]) -> Iterator[SensorSpec]:
    """Yield copies of what sits at an axis, at axes of the same dimension that have none."""
    sites = [sensor for sensor in prototypes if SENSOR_KINDS[sensor.kind].site == "axis"]
    taken = {sensor.site for sensor in sites}
    for prototype in sites:
        dimension = prototype.site.split(".")[1][0]
        for site in config.axes:
            if site not in taken and site.split(".")[1][0] == dimension:
                yield _copy(prototype, site)


def _copy(prototype: SensorSpec, site: str) -> SensorSpec:
    """Return the prototype elsewhere with all its channels; a mounted one keeps its name."""
    channels = tuple(SENSOR_KINDS[prototype.kind].units(site))
    sigma = np.full(len(channels), prototype.sigma.min())
    name = prototype.name if site == prototype.site else f"{prototype.name}_at_{site.replace('.', '_')}"
    return replace(prototype, name=name, site=site, channels=channels, sigma=sigma)
