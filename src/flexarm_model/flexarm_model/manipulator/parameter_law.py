"""Named parameters of a manipulator, and axis coefficients that follow one of them.

A parameter is a number with a unit of any dimension; a law is a list of points, straight between them::

    parameters: {pressure: 2 bar}
    stiffness: {parameter: pressure, at: [1 bar, 2 bar], values: [0.83 N m/deg, 1.66 N m/deg]}

Outside its points a law says nothing: it is refused, never extrapolated.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flexarm_model.settings.strict_yaml import Section
from flexarm_model.settings.units import UNITS

MIN_POINTS = 2  # a line needs two


@dataclass(frozen=True)
class AxisLaw:
    """A coefficient of an axis that follows a parameter.

    Attributes:
        axis: "joint.axis".
        coefficient: Field of `Axis`: "stiffness" or "damping".
        parameter: Name.
        at: Its values, increasing [SI], (k,).
        values: The coefficient's at them [SI], (k,).
        dimension: Of the parameter, a key of ``UNITS``.
    """

    axis: str
    coefficient: str
    parameter: str
    at: tuple[float, ...]
    values: tuple[float, ...]
    dimension: str

    def value(self, at: float) -> float:
        """Return the coefficient at a value of the parameter within the law's points [SI]."""
        return float(np.interp(at, self.at, self.values))


@dataclass(frozen=True)
class Parameter:
    """A named number: what the file says, its value in SI, and its dimension (a key of ``UNITS``)."""

    text: object
    value: float
    dimension: str


def read_parameters(top: Section) -> dict[str, Parameter]:
    """Read ``parameters``, by name; none when the file has none.

    Raises:
        ConfigError: A value is not a number with a unit of one dimension.
    """
    section = top.section("parameters", {})
    return {name: _read_parameter(section, name) for name in section.names()}


class ParameterLaws:
    """Reads axis coefficients, and remembers which parameters they follow.

    Attributes:
        found: The laws read so far.
    """

    def __init__(self, parameters: Mapping[str, Parameter]) -> None:
        """Start with the parameters of a file."""
        self._parameters = dict(parameters)
        self.found: list[AxisLaw] = []

    def coefficient(self, section: Section, key: str, dimension: str, axis: str) -> float:
        """Return a coefficient that is a number or a law, zero when it is not given [SI of ``dimension``].

        Args:
            section: Of the axis.
            key: Of the coefficient.
            dimension: Key of ``UNITS``.
            axis: "joint.axis".

        Raises:
            ConfigError: It is negative, or its law is wrong or does not reach the parameter's value.
        """
        if not isinstance(section.take(key, None), dict):
            return section.quantity(key, dimension, 0.0, at_least=0.0)
        law = section.section(key)
        name = law.choice("parameter", tuple(self._parameters) or ("those of 'parameters', which is empty",))
        parameter = self._parameters[name]
        at, values = _read_points(law, parameter.dimension, dimension)
        law.done()
        if not at[0] <= parameter.value <= at[-1]:
            first, *_, last = law.take("at")
            raise law.error("parameter", f"{name} = {parameter.text}", f"known from {first} to {last} only")
        self.found.append(AxisLaw(axis, key, name, tuple(at), tuple(values), parameter.dimension))
        return self.found[-1].value(parameter.value)

    def refuse_unused(self, top: Section) -> None:
        """Refuse a parameter that nothing follows: changing it would change nothing.

        Raises:
            ConfigError: There is one.
        """
        followed = {law.parameter for law in self.found}
        for name, parameter in self._parameters.items():
            if name not in followed:
                raise top.error(f"parameters.{name}", parameter.text, "no stiffness or damping follows it")


def _read_parameter(section: Section, name: str) -> Parameter:
    text = section.take(name)
    unit = str(text).strip().partition(" ")[2].strip()
    dimensions = [dimension for dimension, units in UNITS.items() if unit in units]
    if len(dimensions) != 1:
        allowed = f"a unit of several dimensions: {', '.join(dimensions)}" if dimensions else "no known unit"
        raise section.error(name, text, f"'{unit}' is {allowed}; expected a number with a unit of one")
    return Parameter(text, section.quantity(name, dimensions[0]), dimensions[0])


def _read_points(law: Section, along: str, of: str) -> tuple[list[float], list[float]]:
    """Return the parameter's values, increasing, and the coefficient's, both in SI."""
    raw = law.take("at")
    if not isinstance(raw, list) or len(raw) < MIN_POINTS:
        raise law.error("at", raw, f"expected a list of at least {MIN_POINTS}")
    at, values = law.quantities("at", [along] * len(raw)), law.quantities("values", [of] * len(raw))
    if not np.all(np.diff(at) > 0.0):
        raise law.error("at", raw, "must increase")
    if values.min() < 0.0:
        raise law.error("values", law.take("values"), "must be at least 0")
    return at.tolist(), values.tolist()
