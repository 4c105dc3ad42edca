"""Settings of the controller: schema of its YAML, source of its ROS parameters."""

from __future__ import annotations

from dataclasses import dataclass

from flexarm_model.settings.parameters import ParameterError, parameter, validate


@dataclass(frozen=True)
class MpcConfig:
    """Weights as deviations that cost the same, horizon and solver of the predictive controller."""

    horizon: int = parameter(40, "Periods that are looked ahead.", minimum=2, maximum=400)
    blocks: tuple[int, ...] = parameter(
        (1,) * 4 + (2,) * 18, "Periods over which each planned torque is held; sum = horizon.", minimum=1
    )
    delay_periods: int = parameter(
        1, "Periods between a state and the torque computed from it; 0 is as 1.", minimum=0, maximum=10
    )
    position_error: float = parameter(0.0092, "Joint error that costs 1.", "rad or m", minimum=1e-9)
    velocity_error: float = parameter(
        0.088, "Joint velocity error that costs 1.", "rad/s or m/s", minimum=1e-9
    )
    modal_energy: float = parameter(1.2e-4, "Energy of the modes that costs 1.", "J", minimum=1e-12)
    modal_cutoff_hz: float = parameter(
        17.0, "Modes well above it are left to their own damping.", "Hz", minimum=1e-3
    )
    input_acceleration: float = parameter(
        1.7, "Torque that costs 1, as acceleration of the joint's inertia.", "rad/s^2 or m/s^2", minimum=1e-6
    )
    input_jerk: float = parameter(
        216.0,
        "Rate of torque that costs 1, as jerk of the joint's inertia.",
        "rad/s^3 or m/s^3",
        minimum=1e-6,
    )
    axis_shares: tuple[float, ...] = parameter(
        (),
        "One for each axis, by which position_error, velocity_error, input_acceleration and input_jerk are "
        "multiplied; none: 1.",
        "1",
        1e-6,
        1e6,
    )
    strain_margin: float = parameter(
        0.1, "Share of the strain limit kept free for estimation errors.", minimum=0.0, maximum=0.9
    )
    velocity_limit: bool = parameter(True, "Keep the joint velocity limits inside the horizon too.")
    slack_price: float = parameter(3.0, "Price of exceeding a soft limit by all of it.", minimum=1e-3)
    backend: str = parameter(
        "daqp",
        "Solver of the quadratic program; another one tries again where it fails.",
        choices=("daqp", "osqp", "hpipm"),
    )
    tolerance: float = parameter(
        1e-5, "Of the scaled problem, for osqp and hpipm; daqp keeps 1e-6.", minimum=1e-9, maximum=1e-4
    )
    max_iterations: int = parameter(2000, "Cap of each stage of the solver.", minimum=1)
    time_limit: float = parameter(
        2.5e-3, "Cap of the solver's wall time; 0 for none, as in lockstep.", "s", minimum=0.0, maximum=1.0
    )
    latency: float = parameter(
        0.0, "Time by which torques act later still; any share of a period.", "s", minimum=0.0, maximum=0.1
    )
    foresight: bool = parameter(False, "Predict with the models that are to come, each from its time on.")
    arm_torque: bool = parameter(
        False, "Plan with the torque of the arm's own motion, unless the estimator's filter is linear."
    )
    position_limit: bool = parameter(True, "Keep the joint position limits inside the horizon too.")
    tip_error: float = parameter(
        0.0, "Error of the tip's position that costs 1; 0 for none.", "m", minimum=0.0
    )
    tip_angle_error: float = parameter(
        0.0, "Error of the tip's orientation that costs 1; 0 for none.", "rad", minimum=0.0
    )
    stiffness_step: float = parameter(
        0.0, "Step of the learned stiffness that changes the model; 0: as described.", "1", 0.0, 0.5
    )
    inertia_step: float = parameter(
        0.0, "Step of an axis' learned inertia that changes the model; 0: as described.", "1", 0.0, 0.5
    )
    disturbance_lag: float = parameter(
        0.12, "Lag of the estimated torque that the inertia is learned from.", "s", minimum=1e-3, maximum=5.0
    )
    firm_time: float = parameter(
        0.0, "Motions over within it that leave no mode ringing are followed exactly.", "s", 0.0, 60.0
    )
    firmness: float = parameter(30.0, "By how much the axes are held firmer then.", "1", 1.0, 1000.0)

    def __post_init__(self) -> None:
        """Check every field.

        Raises:
            ParameterError: A value is outside its range, the blocks do not fill the horizon, or what is
                learned would be lost on models to come.
        """
        validate(self)
        if self.foresight and (self.stiffness_step or self.inertia_step):
            raise ParameterError(
                "foresight: true: expected false where stiffness_step or inertia_step is set: models to come"
                " are as described, not as learned"
            )
        if self.foresight and self.arm_torque:
            raise ParameterError(
                "foresight: true: expected false where arm_torque is set: it is worked out for one model"
            )
        if sum(self.blocks) != self.horizon:
            raise ParameterError(f"blocks: they sum to {sum(self.blocks)}, not to horizon {self.horizon}")


@dataclass(frozen=True)
class ControllerConfig:
    """Law, period and fallbacks."""

    law: str = parameter("mpc", "Law used when all is well.", choices=("mpc", "nmpc", "lqr", "pd"))
    period: float = parameter(0.005, "Control period.", "s", minimum=1e-4, maximum=1.0)
    shifted_periods: int = parameter(5, "Periods an earlier plan may be used on.", minimum=0, maximum=50)
    damping_rate: float = parameter(
        8.0, "Rate at which the damping fallback brings the joints to rest.", "1/s", minimum=0.1
    )
    pd_bandwidth: float = parameter(
        1 / 3, "Natural frequency of the joints under law pd, by the slowest mode's.", "1", 0.01, 100.0
    )
    pd_damping: float = parameter(
        0.7,
        "Damping ratio of the joints under law pd; less where only that bears twice the gains.",
        "1",
        0.05,
        10.0,
    )
    rest_velocity: float = parameter(
        0.01, "Joint velocity below which damping becomes hold.", "rad/s or m/s", minimum=1e-6
    )
    lost_after: float = parameter(
        0.1, "A motion ends when no state could be used for so long; the arm stays there.", "s", 0.0, 60.0
    )
    time_budget: float = parameter(
        0.8, "Share of the period that the law may take by the wall clock; 0 for no limit.", "1", 0.0, 10.0
    )
    start_sigma: float = parameter(
        20.0, "3 sigma of the state, in deviations that cost 1, at which the law may take over.", "1", 1e-3
    )

    def __post_init__(self) -> None:
        """Check every field.

        Raises:
            ParameterError: A value is outside its range.
        """
        validate(self)


@dataclass(frozen=True)
class MarginConfig:
    """What the loop must bear before the arm may move; see ``margins``."""

    margins_required: bool = parameter(
        True, "Send nothing while the margins of the loop are not known or too small."
    )
    gain_margin_db: float = parameter(6.0, "Gain margin wanted of every mode, as described", "dB", 0.0, 60.0)
    torque_gain_margin_db: float = parameter(
        2.0, "The same of all torques at once: a motor constant may be off by a fifth", "dB", 0.0, 60.0
    )
    delay_margin_periods: float = parameter(
        0.5, "Delay margin wanted; a latency is compensated in whole periods", "periods", 0.0, 4.0
    )
    off_share: float = parameter(0.5, "Share of these wanted where frequencies are off", "1", 0.0, 1.0)
    frequency_off: float = parameter(0.10, "Relative error of all frequencies to be borne", "1", 0.0, 0.4)
    firm_growth: float = parameter(
        2.0, "Factor by which vibration may grow while a firm law lasts", "1", 1.0, 100.0
    )
    extra_modes: int = parameter(3, "Modes per body beyond those described", minimum=0, maximum=20)
    fastest_mode: float = parameter(3.0, "Modes up to so many times the control rate count", "1", 0.5, 20.0)

    def __post_init__(self) -> None:
        """Check every field.

        Raises:
            ParameterError: A value is outside its range.
        """
        validate(self)
