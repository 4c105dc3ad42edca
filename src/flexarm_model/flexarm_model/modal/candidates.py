"""Sensors that could be mounted: copies of a prototype at every node of every flexible body.

A prototype is a mounted sensor, or one that the caller holds in the hand. It measures on all its
channels, so an accelerometer with one axis is also tried along the other two. A sensor with an offset
from the beam's axis (a gauge) belongs to its own body's section and stays there.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from flexarm_model.description import Beam, ManipulatorConfig, SensorSpec
from flexarm_model.sensor_kinds import SENSOR_KINDS


def candidate_config(config: ManipulatorConfig, extra: Iterable[SensorSpec] = ()) -> ManipulatorConfig:
    """Return the arm with all sensors that could be mounted instead of those that are.

    Linearising it about the same pose gives rows in the same coordinates.

    Args:
        config: The description.
        extra: Prototypes beside the mounted sensors, at any node.
    """
    prototypes = [sensor for sensor in (*config.sensors, *extra) if SENSOR_KINDS[sensor.kind].site == "node"]
    nodes = [
        (body.name, node) for body in config.bodies.values() if isinstance(body, Beam) for node in body.nodes
    ]
    found: dict[tuple[object, ...], SensorSpec] = {}
    for prototype in prototypes:
        for body, node in nodes:
            if any(prototype.offset) and body != prototype.site.split(".")[0]:
                continue
            copy = _copy(prototype, body, node)
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


def _copy(prototype: SensorSpec, body: str, node: str) -> SensorSpec:
    """Return the prototype at another node with all its channels; a mounted one keeps its name."""
    site = f"{body}.{node}"
    channels = tuple(SENSOR_KINDS[prototype.kind].units(site))
    sigma = np.full(len(channels), prototype.sigma.min())
    name = prototype.name if site == prototype.site else f"{prototype.name}_at_{body}_{node}"
    return replace(prototype, name=name, site=site, channels=channels, sigma=sigma)
