"""The simulated rig moved for ``--joints``: every axis by a few slow sines, under joint PD on the drives."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.drift_run.drives_alone import drive_alone, slowest
from flexarm_bringup.identify.joint_records import encoder_of_axes
from flexarm_bringup.identify.measurement import SourceError
from flexarm_bringup.sim.rig import Rig, RigSettings
from flexarm_bringup.sim.sample import Sample
from flexarm_controller.reference import Reference
from flexarm_model.identification.joint_regression import JointMotion
from flexarm_model.manipulator.description import Axis, ManipulatorConfig
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
SLOWEST, FASTEST, SINES = 0.1, 1.0 / 8.0, 3  # Hz; of the slowest mode; per axis
STRIDE, SPEED, TORQUE = 0.3, 0.4, 0.3  # rad or m at most; shares of the limits of velocity and torque
LEAST_ROOM = 1e-3  # rad or m
RAMP = 2.0  # s in which the sines begin


def move_rig(
    config: ManipulatorConfig,
    model: ReducedModel,
    settings: RigSettings,
    duration: float,
    say: Callable[[str], None],
) -> JointMotion:
    """Move the simulated rig and return what its encoders said.

    Args:
        config: The manipulator.
        model: Served at home.
        settings: How the rig differs.
        duration: Of the motion [s].
        say: Is told how far it is.

    Raises:
        SourceError: It has no motor, or one without encoder or room at home.
    """
    _refuse_stuck(config)
    used = encoder_of_axes(config)
    say("rig: building")
    rig = Rig(config, settings)
    heard: dict[str, dict[float, float]] = {name: {} for name in used.values()}  # by instant [periods]
    delays = {spec.name: spec.stamp_delay for spec in config.sensors}
    torques: list[Array] = []

    def hear(rig: Rig, samples: list[Sample], tau: Array) -> None:
        """Note what the encoders say, and the torque."""
        for sample in samples:
            if sample.sensor in heard:
                late = 1e-9 * sample.late_ns - delays[sample.sensor]  # s
                heard[sample.sensor][sample.tick + late / rig.dt] = float(sample.y[0])
        torques.append(tau)
        if not rig.tick % round(1.0 / rig.dt):
            say(f"moving: {rig.tick * rig.dt:.0f} of {duration:.0f} s")

    drive_alone(rig, model, slow_sines(config, model, duration, rig.dt), duration, hear)
    at = np.arange(1, len(torques) + 1)
    q = np.column_stack([np.interp(at, [*told], [*told.values()]) for told in heard.values()])
    by_axis = dict(zip(config.actuated, np.array(torques[1:] + torques[-1:]).T, strict=True))
    tau = [by_axis.get(axis, np.zeros(len(q))) for axis in used]
    return JointMotion(tuple(used), q, np.column_stack(tau), rig.dt)


def _refuse_stuck(config: ManipulatorConfig) -> None:
    """Refuse an arm that cannot be moved."""
    if not config.actuated:
        raise SourceError(f"{config.name} has no motor: nothing moves its joints")
    for (name, axis), home in zip(config.actuated.items(), config.home, strict=True):
        if min(axis.upper - home, home - axis.lower) < LEAST_ROOM:
            raise SourceError(
                f"{name}: home at {home:.6g} leaves no room in {axis.lower:.6g} to {axis.upper:.6g}; "
                f"expected at least {LEAST_ROOM:g} rad or m on either side"
            )


def slow_sines(config: ManipulatorConfig, model: ReducedModel, duration: float, dt: float) -> Reference:
    """Return the reference: sines below the modes, of other frequencies for every axis, within its limits."""
    t = np.asarray(np.arange(0.0, duration + dt, dt), dtype=np.float64)
    highest = FASTEST * slowest(model, dt) / (2 * np.pi)
    count = SINES * model.n_theta
    f_hz = np.linspace(SLOWEST, max(highest, 2 * SLOWEST), count).reshape(SINES, model.n_theta)
    ramp = np.clip(t / RAMP, 0.0, 1.0)
    ramp = ramp**3 * (10 - 15 * ramp + 6 * ramp**2)
    theta = np.empty((t.size, model.n_theta))
    for k, axis in enumerate(config.actuated.values()):
        shape = ramp * np.sin(2 * np.pi * np.outer(t, f_hz[:, k]) + np.arange(SINES)).sum(axis=1)
        shape -= shape[0]
        theta[:, k] = (
            config.home[k] + _amplitude(axis, shape, dt, float(model.M[k, k]), config.home[k]) * shape
        )
    theta_dot: Array = np.asarray(np.gradient(theta, dt, axis=0), dtype=np.float64)
    theta_ddot: Array = np.asarray(np.gradient(theta_dot, dt, axis=0), dtype=np.float64)
    return Reference(t, theta, theta_dot, theta_ddot)


def _amplitude(axis: Axis, shape: Array, dt: float, inertia: float, home: float) -> float:
    """Return the factor that keeps range, speed and torque of an axis."""
    room = min(axis.upper - home, home - axis.lower, 2 * STRIDE) / 2
    speed = np.gradient(shape, dt)
    return float(
        min(
            room / abs(shape).max(),
            SPEED * axis.velocity / abs(speed).max(),
            TORQUE * axis.effort / (inertia * abs(np.gradient(speed, dt)).max()),
        )
    )
