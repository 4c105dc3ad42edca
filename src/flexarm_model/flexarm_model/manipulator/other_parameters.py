"""The same arm with other values of its named parameters: a pressure that changes, a temperature."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from flexarm_model.manipulator.description import Joint, ManipulatorConfig
from flexarm_model.manipulator.parameter_law import AxisLaw


class ParameterRangeError(ValueError):
    """The arm has no such parameter, or no law reaches its value; says what is known."""


def parameter_range(config: ManipulatorConfig, name: str) -> tuple[float, float]:
    """Return the lowest and the highest value for which all laws of a parameter are known [SI].

    Raises:
        ParameterRangeError: The arm has no such parameter.
    """
    followed = [law for law in config.laws if law.parameter == name]
    if not followed:
        known = ", ".join(config.parameters) or "none"
        raise ParameterRangeError(f"'{config.name}' has no parameter '{name}'; it has {known}")
    return max(law.at[0] for law in followed), min(law.at[-1] for law in followed)


def under(config: ManipulatorConfig, parameters: Mapping[str, float]) -> ManipulatorConfig:
    """Return the arm with other values of some of its parameters; its identity stays.

    A coefficient changes by the ratio that its law gives, so that what scales the arm goes on to do so.

    Args:
        config: The arm.
        parameters: By name [SI]; those that are not given stay.

    Raises:
        ParameterRangeError: There is no such parameter, or a law does not reach its value.
    """
    for name, value in parameters.items():
        low, high = parameter_range(config, name)
        if not low <= value <= high:
            raise ParameterRangeError(
                f"'{config.name}': {name} = {value:g} is not within {low:g} ... {high:g}"
            )
    values = {**config.parameters, **parameters}
    if values == config.parameters:
        return config
    laws: dict[str, list[AxisLaw]] = {}
    for law in config.laws:
        laws.setdefault(law.axis, []).append(law)
    joints, closures = (
        tuple(_changed(joint, laws, config.parameters, values) for joint in group)
        for group in (config.joints, config.closures)
    )
    return replace(config, joints=joints, closures=closures, parameters=values)


def _changed(
    joint: Joint, laws: Mapping[str, list[AxisLaw]], before: Mapping[str, float], after: Mapping[str, float]
) -> Joint:
    axes = []
    for axis in joint.axes:
        now = {"stiffness": axis.stiffness, "damping": axis.damping}
        for law in laws.get(f"{joint.name}.{axis.name}", ()):
            old, new = law.value(before[law.parameter]), law.value(after[law.parameter])
            now[law.coefficient] = now[law.coefficient] * new / old if old > 0.0 else new
        axes.append(replace(axis, stiffness=now["stiffness"], damping=now["damping"]))
    return replace(joint, axes=tuple(axes))
