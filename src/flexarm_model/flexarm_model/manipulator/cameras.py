"""What looks at the tip from outside: each speaks on a topic of its own, ``camera/pose`` if none is named."""

from __future__ import annotations

from collections.abc import Iterable

from flexarm_model.manipulator.sensor_spec import SensorSpec

CAMERA = "camera"
USUAL = "pose"


def cameras(sensors: Iterable[SensorSpec]) -> dict[str, SensorSpec]:
    """Return the cameras by the last part of their topic, in the order of the description."""
    return {spec.topic or USUAL: spec for spec in sensors if spec.kind == CAMERA}


def camera_topic(spec: SensorSpec) -> str:
    """Return the relative topic of a camera."""
    return f"{CAMERA}/{spec.topic or USUAL}"


def camera_misfit(spec: SensorSpec, others: Iterable[SensorSpec]) -> str:
    """Return why a camera cannot stand beside others; empty when it can."""
    name = spec.topic or USUAL
    if not name.isidentifier() or not name.isascii():
        return "expected a name that a topic may bear: letters, digits and _, no digit first"
    other = cameras(others).get(name)
    return (
        f"is the topic of '{other.name}' already; expected a name of its own (camera/NAME)" if other else ""
    )
