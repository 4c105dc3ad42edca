"""Faults of sensors as one line of text, for parameters and command lines.

    root_strain: off 1 3; camera: delayed 60 ms jitter 20 ms; tip_accelerometer: bias 1 m/s^2 2

``SENSOR: KIND [START [END]] [WORD VALUE [UNIT]] ...``: plain numbers are start and end [s]; a number with a
unit and no word before it is the kind's first setting.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from flexarm_bringup.sim.sensor_faults import KINDS, SensorFault
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.settings.strict_yaml import ConfigError
from flexarm_model.settings.units import axis_dimension, parse_quantity, si_unit

OF_SENSOR, NAME, NUMBER = "of the sensor", "name", "number"


class _Word(NamedTuple):
    """A setting as it is written: field of ``SensorFault``, and dimension of its value."""

    field: str
    dimension: str


_WORDS = {
    "share": _Word("share", "ratio"),
    "spike": _Word("spike", "ratio"),
    "factor": _Word("factor", "ratio"),
    "limit": _Word("limit", OF_SENSOR),
    "named": _Word("named", NAME),
    "stamp": _Word("stamp", "time"),
    "rate": _Word("rate_hz", "frequency"),
    "delay": _Word("delay", "time"),
    "jitter": _Word("jitter", "time"),
    "period": _Word("period", "time"),
    "bias": _Word("bias", OF_SENSOR),
    "ramp": _Word("ramp", "time"),
    "value": _Word("value", NUMBER),
}
_WORDS_OF: dict[str, tuple[str, ...]] = {  # of each kind, the first one first
    "garbage": ("share", "spike"),
    "wrong": ("factor", "limit", "stamp", "named"),
    "slow": ("rate",),
    "delayed": ("delay", "jitter"),
    "intermittent": ("period", "share"),
    "bias": ("bias", "ramp"),
    "nan": ("value", "share"),
}
_DIMENSIONS = {
    "strain_gauge": "strain",
    "accelerometer": "acceleration",
    "gyroscope": "angular velocity",
    "camera": "length",
}
_NUMERIC = re.compile(r"[-+]?(\d|\.\d|inf|nan)")


def parse_faults(text: str, sensors: Sequence[SensorSpec]) -> dict[str, SensorFault]:
    """Return the faults by sensor.

    Args:
        text: See the module; empty for none.
        sensors: Those of the manipulator.

    Raises:
        ConfigError: Something cannot be understood; names the sensor, the kind, and what is allowed.
    """
    specs = {spec.name: spec for spec in sensors}
    faults: dict[str, SensorFault] = {}
    for part in filter(None, (part.strip() for part in text.split(";"))):
        name, colon, rest = (piece.strip() for piece in part.partition(":"))
        if not colon or name not in specs:
            raise ConfigError(f"faults: '{part}': must begin with one of {', '.join(specs)}, and ':'")
        if name in faults:
            raise ConfigError(f"faults: '{name}' is given twice; give it once")
        kind, *words = rest.split() or [""]
        if kind not in KINDS:
            raise ConfigError(f"faults: {name}: kind '{kind}' is not one of {', '.join(KINDS)}")
        try:
            alike = tuple(other for other, spec in specs.items() if are_alike(spec, specs[name]))
            faults[name] = SensorFault(kind, **_settings(kind, words, specs[name], alike))
        except ValueError as error:
            raise ConfigError(f"faults: {name}: {kind}: {error}") from None
    return faults


def are_alike(one: SensorSpec, other: SensorSpec) -> bool:
    """Tell whether a sensor may speak under the name of another: its messages have the same numbers."""
    return one.kind == other.kind and len(one.channels) == len(other.channels)


def faults_text(faults: Mapping[str, SensorFault], sensors: Sequence[SensorSpec]) -> str:
    """Return faults as ``parse_faults`` reads them, all numbers in SI."""
    specs = {spec.name: spec for spec in sensors}
    return "; ".join(f"{name}: {_fault_text(fault, specs[name])}" for name, fault in faults.items())


def _fault_text(fault: SensorFault, spec: SensorSpec) -> str:
    parts = [fault.kind, repr(fault.start)]
    parts += [] if fault.end == SensorFault.end else [repr(fault.end)]
    for name in _WORDS_OF.get(fault.kind, ()):
        word = _WORDS[name]
        value = getattr(fault, word.field)
        if repr(value) != repr(getattr(SensorFault, word.field)):  # also where it is NaN
            dimension = _dimension(word, spec)
            unit = "" if dimension in (NAME, NUMBER) else si_unit(dimension)
            parts.append(" ".join([name, str(value), unit]).strip())
    return " ".join(parts)


def _settings(kind: str, words: list[str], spec: SensorSpec, names: tuple[str, ...]) -> dict[str, Any]:
    """Return the fields of a fault from the words behind its kind."""
    allowed = _WORDS_OF.get(kind, ())
    found: dict[str, Any] = {}
    while words:
        first = words.pop(0)
        is_number = bool(_NUMERIC.match(first))
        has_unit = bool(words) and words[0] not in _WORDS and not _NUMERIC.match(words[0])
        if is_number and not has_unit:
            field = "start" if "start" not in found else "end"
            _put(found, field, parse_quantity(f"{first} s", "time"))
            continue
        name, value = (allowed[0], first) if is_number and allowed else (first, "")
        if name not in allowed:
            settings = ", ".join(("START", "END", *allowed))
            raise ValueError(f"'{first}' is not one of its settings: {settings}")
        value = value or (words.pop(0) if words else "")
        has_unit = bool(words) and words[0] not in _WORDS and not _NUMERIC.match(words[0])
        unit = words.pop(0) if has_unit else ""
        _put(found, _WORDS[name].field, _value(name, value, unit, spec, names))
    return found


def _value(name: str, value: str, unit: str, spec: SensorSpec, names: tuple[str, ...]) -> float | str:
    dimension = _dimension(_WORDS[name], spec)
    if dimension == NAME:
        if value not in names or unit:
            raise ValueError(f"{name} '{value}' is not one of {', '.join(names)}")
        return value
    try:
        return float(value) if dimension == NUMBER else parse_quantity(f"{value} {unit}".strip(), dimension)
    except ValueError as error:
        raise ValueError(f"{name} '{value}': {error}") from None


def _put(found: dict[str, Any], field: str, value: float | str) -> None:
    if field in found:
        raise ValueError(f"{field} is given twice")
    found[field] = value


def _dimension(word: _Word, spec: SensorSpec) -> str:
    if word.dimension != OF_SENSOR:
        return word.dimension
    if spec.kind in _DIMENSIONS:
        return _DIMENSIONS[spec.kind]
    return axis_dimension(spec.site, "position")
