"""Settings of the estimator: physical quantities, from which the noise intensities follow."""

from __future__ import annotations

from dataclasses import dataclass

from flexarm_model.settings.parameters import parameter


@dataclass(frozen=True)
class EstimatorConfig:
    """What is not known of the arm, and what makes a sample or a state unfit for use.

    Accelerations of axes stand for [rad/s^2] of rotary and [m/s^2] of linear ones; multiplied by
    the inertia of the axis they become torques, so the same values fit a heavy and a light hub.
    """

    filter: str = parameter(
        "linear",
        "Kalman filter: linear on the served model, corrected by what the arm's motion adds to it, "
        "extended or unscented on that motion.",
        choices=("linear", "corrected", "extended", "unscented"),
    )
    loss: str = parameter(
        "square",
        "What a sample costs that is off: its square (the Kalman filter), or less beyond a sigma or two, "
        "found over the horizon in every step; takes milliseconds.",
        choices=("square", "huber", "cauchy"),
    )
    horizon: float = parameter(
        0.1, "Samples of the last so many seconds are weighed by that loss; at most history", "s", 0.0, 2.0
    )
    frequency_error: float = parameter(
        0.10, "Relative error of the modes' frequencies that the filter must bear", "1", 0.0, 0.5
    )
    motion_acceleration: float = parameter(
        1.0, "Typical acceleration of the actuated axes; it excites the modes", "rad/s^2", 1e-3, 1e4
    )
    modal_force: float = parameter(
        0.13, "Unmodelled force on every mode, also those that no axis excites", "kg^0.5 m/s^2", 1e-6, 1e3
    )
    acceleration_noise: float = parameter(
        0.01, "White torque noise of the axes as acceleration", "rad/s^2/sqrt(Hz)", 1e-6, 1e3
    )
    disturbance_drift: float = parameter(
        0.03, "Drift of the unmodelled torque as acceleration", "rad/s^2/sqrt(s)", 1e-6, 1e4
    )
    initial_position: float = parameter(1.0, "One sigma of the axes at the start", "rad", 1e-6, 1e2)
    initial_velocity: float = parameter(1.0, "One sigma of their velocities at the start", "rad/s", 1e-6, 1e3)
    initial_disturbance: float = parameter(
        3.0, "One sigma of the unmodelled torque at the start, as acceleration", "rad/s^2", 1e-6, 1e4
    )
    force_averaging: float = parameter(
        0.005, "Time over which an accelerometer averages the force noise", "s", 1e-4, 0.1
    )
    acceleration_error: float = parameter(
        0.0,
        "Error of predicted accelerations (centrifugal), beside the noise",
        "m/s^2",
        0.0,
        1e3,
    )
    strain_error: float = parameter(
        0.0, "Error of predicted strains, beside the gauges' noise", "1", 0.0, 0.1
    )
    isolation_strain_error: float = parameter(
        8e-6, "Most of strain_error that counts when faulty channels are looked for", "1", 0.0, 0.1
    )
    sag_modes: int = parameter(
        0, "Slowest modes that may rest elsewhere than modelled, as states", "1", 0, 100
    )
    sag_error: float = parameter(1e-3, "One sigma of how far off its model the tip rests", "m", 1e-9, 1.0)
    sag_time: float = parameter(3.0, "Time in which that changes, as a pose lasts", "s", 0.01, 1e4)
    sag_share: float = parameter(
        0.0, "One sigma of the share by which it sags further than modelled; 0 learns none", "1", 0.0, 1.0
    )
    sag_share_time: float = parameter(
        300.0, "Time in which that changes, as an arm stays as it is", "s", 0.01, 1e5
    )
    stiffness_modes: int = parameter(
        0, "Slowest modes whose common error of stiffness is learned; 0 takes them as described", "1", 0, 100
    )
    stiffness_error: float = parameter(
        0.2, "One sigma of that error, relative; it is held within three", "1", 1e-3, 0.3
    )
    stiffness_time: float = parameter(
        10.0, "Time after which what was learned of it counts 1/e", "s", 0.1, 1e4
    )
    stiffness_rest: float = parameter(
        0.02, "Share of frequency_error and modal_force that is left for the modes it is of", "1", 1e-3, 1.0
    )
    gate: float = parameter(5.0, "Samples further from the prediction are refused", "sigma", 2.0, 100.0)
    lone_gate: float = parameter(
        0.0,
        "Jump or shift of a sensor alone from which on it is refused, against what is usual; 0: as the gate.",
        "sigma",
        0.0,
        100.0,
    )
    reopen_after: int = parameter(5, "Refusals in a row after which the state is doubted", "1", 1, 1000)
    reopen_interval: float = parameter(
        0.5, "A second doubt within this time means that sensors contradict each other", "s", 0.0, 60.0
    )
    distrust: float = parameter(
        0.2, "A sensor found to contradict the others must agree with them for this time", "s", 0.05, 3600.0
    )
    bias_patience: float = parameter(
        0.5, "A bias at its limit for so long puts its sensor out of use", "s", 0.0, 3600.0
    )
    history: float = parameter(0.3, "Samples older than this are refused", "s", 0.01, 2.0)
    future_tolerance: float = parameter(0.005, "Stamps may lie this far in the future", "s", 0.0, 0.1)
    max_gap: float = parameter(0.1, "After a longer gap the filter starts anew", "s", 0.01, 1.0)
    time_out: float = parameter(0.04, "Silence beyond latency and three sample periods", "s", 0.005, 1.0)
    position_time_out: float = parameter(
        0.2, "Lost after this time without sensors that locate the axes", "s", 0.01, 10.0
    )
    lost_sigma: float = parameter(
        0.01, "Lost when one sigma of the tip's position is larger", "m", 1e-6, 10.0
    )
    calibrate_latency: bool = parameter(False, "Use the delay of the camera's stamps that is found out")
    latency_memory: float = parameter(
        20.0, "Time after which a frame counts 1/e when that delay is found out", "s", 1.0, 3600.0
    )
    latency_rate: float = parameter(
        0.01, "Rate at which the delay in use follows the one found out", "1", 1e-4, 1.0
    )
