"""What of all interventions stands: who is off, and the noise that was set; not the states.

It is told as the interventions that make it of an estimator as described, so that an estimator that comes
back after a crash can do them again: a sensor is mostly off because it lies.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict

import numpy as np

from flexarm_estimator.estimator import Estimator
from flexarm_estimator.interventions.intervention import Intervention
from flexarm_estimator.interventions.set_noise import SETTINGS, SetNoise
from flexarm_estimator.interventions.toggle_sensor import ToggleSensor
from flexarm_estimator.judging.switched_channels import switch
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.manipulator.sensor_spec import SensorSpec

_KINDS = {kind.__name__: kind for kind in (ToggleSensor, SetNoise)}


def standing(
    estimator: Estimator, sensors: Sequence[SensorSpec], settings: EstimatorConfig
) -> Iterator[Intervention]:
    """Yield what makes an estimator like this one, but for its state, of a new one.

    Args:
        estimator: As it is now.
        sensors: As described, in the same order.
        settings: That it was made with.
    """
    for spec, described in zip(estimator.specs, sensors, strict=True):
        out = tuple(channel for channel in described.channels if channel not in spec.channels)
        if out:
            yield ToggleSensor(spec.name, False, out)
        if not np.array_equal(spec.sigma, switch(described, out, False).sigma):
            yield SetNoise(spec.name, tuple(spec.sigma.tolist()))
        if estimator.health.is_off(spec.name):
            yield ToggleSensor(spec.name, False)
    for name in SETTINGS:
        if (value := getattr(estimator.config, name)) != getattr(settings, name):
            yield SetNoise(name, (value,))


def write_standing(interventions: Sequence[Intervention]) -> str:
    """Return interventions as text (JSON); empty for none."""
    told = [{"kind": type(each).__name__, **asdict(each)} for each in interventions]  # type: ignore[call-overload]
    return json.dumps(told) if told else ""


def read_standing(text: str) -> tuple[Intervention, ...]:
    """Return the interventions of a text.

    Raises:
        ValueError: Nobody has written it here; says what is wrong with it.
    """
    try:
        return tuple(_read(dict(item)) for item in (json.loads(text) if text else ()))
    except (KeyError, TypeError) as error:
        raise ValueError(f"{type(error).__name__}: {error}") from None


def _read(item: dict[str, object]) -> Intervention:
    kind = _KINDS[str(item.pop("kind"))]
    told = {name: tuple(value) if isinstance(value, list) else value for name, value in item.items()}
    return kind(**told)  # type: ignore[arg-type]
