"""Inertial measurement units: accelerometer and gyroscope of a node may share the messages of one driver.

Each is a sensor of its own, with noise, faults and health of its own; the key ``imu`` names the unit, and so
the topic, that carries it.
"""

from __future__ import annotations

from collections.abc import Iterable

from flexarm_model.manipulator.sensor_spec import SensorSpec

INERTIAL = ("accelerometer", "gyroscope")


def imus(sensors: Iterable[SensorSpec]) -> dict[str, tuple[SensorSpec, ...]]:
    """Return the sensors of every unit by its name, in the order of the description."""
    units: dict[str, tuple[SensorSpec, ...]] = {}
    for spec in sensors:
        if spec.kind in INERTIAL:
            units[unit_of(spec)] = (*units.get(unit_of(spec), ()), spec)
    return units


def unit_of(spec: SensorSpec) -> str:
    """Return the name of the unit that carries an inertial sensor."""
    return spec.imu or spec.name


def misfit(spec: SensorSpec, others: Iterable[SensorSpec]) -> str:
    """Return why an inertial sensor cannot be part of its unit beside others; empty when it can."""
    unit = unit_of(spec)
    for other in imus(others).get(unit, ()):
        if other.kind == spec.kind:
            return f"has {other.kind} '{other.name}' already; expected a unit with at most one of each kind"
        if other.site != spec.site:
            return f"sits at '{other.site}' with '{other.name}', not at '{spec.site}'; a unit has one node"
    if not unit.isidentifier() or not unit.isascii():
        return "expected a name that a topic may bear: letters, digits and _, no digit first"
    return ""
