"""Limits of an arm that the controller keeps: torque, its rate, velocity, position, strain."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.modal.read_only import lock_arrays
from flexarm_model.settings.strict_yaml import ConfigError

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Limits:
    """Symmetric limits of the actuated axes and of the gauges; ``inf`` means no limit.

    Attributes:
        effort: Largest torque [N m] or force [N], (n_theta,).
        effort_rate: Largest rate of change of the effort [N m/s] or [N/s], (n_theta,).
        velocity: Largest velocity [rad/s] or [m/s], (n_theta,).
        position_low: Smallest position [rad] or [m], (n_theta,).
        position_high: Largest position [rad] or [m], (n_theta,).
        gauges: Output rows that measure strain, "gauge.channel", (n_gauges,).
        strain: Largest strain at each of them [1], (n_gauges,).
    """

    effort: Array
    effort_rate: Array
    velocity: Array
    position_low: Array
    position_high: Array
    gauges: tuple[str, ...]
    strain: Array

    def __post_init__(self) -> None:
        """Check shapes and signs, and make the arrays read-only; the caller's own are copied.

        Raises:
            ValueError: A field has the wrong length or a value that is no limit.
        """
        lock_arrays(self)
        n = self.effort.size
        for field in fields(self):
            value = getattr(self, field.name)
            if not isinstance(value, np.ndarray):
                continue
            length = len(self.gauges) if field.name == "strain" else n
            if value.shape != (length,) or np.isnan(value).any():
                raise ValueError(f"limits.{field.name}: {value} is not {length} numbers")
            if not field.name.startswith("position") and (value <= 0).any():
                raise ValueError(f"limits.{field.name}: {value} must be positive")
        if not np.isfinite(self.effort).all():
            raise ValueError(f"limits.effort: {self.effort} must be finite")
        if (self.position_low >= self.position_high).any():
            raise ValueError(f"limits.position_low: {self.position_low} not below {self.position_high}")

    def without_strain(self) -> Limits:
        """Return them for motions planned here: the planner bounds their strain, and stops may use it."""
        return replace(self, strain=np.full(self.strain.shape, np.inf))


def limits_of(config: ManipulatorConfig) -> Limits:
    """Return the limits that the description gives the controller.

    Raises:
        ConfigError: An actuated axis has no effort, without which no law and no guard can be made.
    """
    missing = [name for name, axis in config.actuated.items() if not np.isfinite(axis.effort)]
    if missing:
        unit = "N m" if missing[0].rpartition(".")[2].startswith("r") else "N"
        keys = ", ".join("joints.{}.axes.{}.effort".format(*name.rpartition(".")[::2]) for name in missing)
        raise ConfigError(
            f"{config.name}: {keys}: is missing; an actuated axis must have it, its largest torque or force, "
            f"such as 'effort: 20 {unit}'"
        )
    axes = list(config.actuated.values())
    gauges = [spec for spec in config.sensors if spec.kind == "strain_gauge"]
    return Limits(
        effort=np.array([axis.effort for axis in axes]),
        effort_rate=np.array([axis.effort_rate for axis in axes]),
        velocity=np.array([axis.velocity for axis in axes]),
        position_low=np.array([axis.lower for axis in axes]),
        position_high=np.array([axis.upper for axis in axes]),
        gauges=tuple(f"{spec.name}.{channel}" for spec in gauges for channel in spec.channels),
        strain=np.array([spec.limit for spec in gauges for _ in spec.channels]),
    )
