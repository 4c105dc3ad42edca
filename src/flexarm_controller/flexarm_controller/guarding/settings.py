"""The settings of the guard."""

from __future__ import annotations

from dataclasses import dataclass

from flexarm_controller.guarding.plausibility import VELOCITY_SMOOTHING
from flexarm_model.settings.parameters import parameter, validate


@dataclass(frozen=True)
class GuardSettings:
    """Settings of the guard."""

    max_age: float = parameter(
        0.05, "Silence of the controller that stops the arm; at least three periods.", "s", 0.005, 1.0
    )
    arming_time: float = parameter(2.0, "Time the controller has for its first command.", "s", 0.05, 60.0)
    braking_gain: float = parameter(
        0.4, "Gain of holding over the one with which the arm would ring up.", "1", 0.01, 0.9
    )
    braking_share: float = parameter(0.5, "Share of the torque limit that a stop needs.", "1", 0.05, 1.0)
    braking_reserve: float = parameter(
        2.0, "Largest deceleration of a stop over the one it is planned with.", "1", 1.0, 10.0
    )
    rest_velocity: float = parameter(0.01, "Axis velocity that counts as rest.", "rad/s", 1e-6, 1.0)
    energy_margin: float = parameter(
        2.0, "Energy that the motors may put in within 250 ms over what the arm can take.", "1", 1.0, 100.0
    )
    velocity_margin: float = parameter(
        1.2, "Velocity that stops the arm over the limit of the description.", "1", 1.0, 10.0
    )
    position_noise: float = parameter(
        30.0,
        "Noise of the drives' positions that is believed, over that of the described encoders.",
        "1",
        0.0,
        1e4,
    )
    velocity_offset: float = parameter(
        0.01, "Offset of the drives' velocity that is believed.", "rad/s", 1e-6, 1.0
    )
    velocity_delay: float = parameter(
        0.01, "Delay of the drives' velocity that is believed, if more than two periods.", "s", 0.0, 0.1
    )
    velocity_smoothing: float = parameter(
        VELOCITY_SMOOTHING,
        "Share of the newest difference of positions in the drives' velocity; the rest is memory.",
        "1",
        0.01,
        1.0,
    )
    strain_margin: float = parameter(
        1.0, "Strain that stops the arm over the limit of the description.", "1", 0.1, 10.0
    )
    changeover: float = parameter(
        1.0, "Time for which commands of the model served before still pass.", "s", 0.0, 60.0
    )

    def __post_init__(self) -> None:
        """Check every field: a silence that is no number would let the arm run on without a controller.

        Raises:
            ParameterError: A value is outside its range.
        """
        validate(self)
