"""What is told of the named parameters of an arm: when is a change worth other models?"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.other_parameters import parameter_range

PARAMETER_STEP = 0.01  # of the range of a parameter: a change that is worth other models
DEVIATIONS = 3.0  # a change of so many standard deviations of what is told is none of noise


class ParameterWatch:
    """Remembers what was told last, and what the models in use are made for.

    Attributes:
        used: Values that the models in use are made for, by name [SI].
        refused: Why no models are made for what was told; empty where they are.
        silence: Tells of whom nothing is heard.
    """

    def __init__(self, config: ManipulatorConfig, step: float) -> None:
        """Start with the values of the description.

        Args:
            config: The arm.
            step: Change of a parameter that is worth other models, of the range in which its laws are known.
        """
        self._ranges = {name: parameter_range(config, name) for name in config.parameters}
        self._least = {name: step * (high - low) for name, (low, high) in self._ranges.items()}
        self.used, self.refused = dict(config.parameters), ""
        self.silence: Callable[[], str] = str
        self._told, self._trouble = dict(config.parameters), dict.fromkeys(config.parameters, "")
        self._due = dict.fromkeys(config.parameters, False)

    @property
    def trouble(self) -> str:
        """What is wrong with what was told, or that nothing is; empty if all is well."""
        return "; ".join(filter(None, (self.refused, *self._trouble.values(), self.silence())))

    @property
    def is_due(self) -> bool:
        """Whether what was told is worth other models than those in use."""
        return any(self._due.values())

    def hear(self, name: str, value: float, variance: float = 0.0) -> None:
        """Take a value [SI].

        Args:
            name: Of the parameter.
            value: What it is said to be; beyond its range the nearest end counts.
            variance: Of the value; 0 or less: unknown.
        """
        (low, high), least = self._ranges[name], self._least[name]
        if not math.isfinite(value):
            self._trouble[name] = f"{name}: {value} is no number; still {self._told[name]:g}"
            return
        noise = DEVIATIONS * math.sqrt(variance) if variance > 0.0 and math.isfinite(variance) else 0.0
        within, least = min(max(value, low), high), max(least, noise)
        is_far_out = abs(value - within) > least
        known = f"{low:g} ... {high:g} where it is known; {within:g} is taken"
        self._trouble[name] = f"{name}: {value:g} is not within {known}" if is_far_out else ""
        self._told[name], self._due[name] = within, abs(within - self.used[name]) > least

    def told(self) -> dict[str, float]:
        """Return what was told last, by name [SI]."""
        return dict(self._told)

    def use(self, values: Mapping[str, float]) -> None:
        """Note that models are made for these values, by name [SI]."""
        self.used, self.refused = dict(values), ""
        self._due = dict.fromkeys(values, False)
