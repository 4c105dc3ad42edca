"""The contracts of the README, each called by hand: the model in three forms, the loop closed on a rig.

Run it with ``python examples/loop_by_hand.py`` in ``./flexarm shell``, or cell by cell in a notebook there.
No ROS is needed.
"""

from __future__ import annotations

import numpy as np

from flexarm_bringup.closed_loop import arm_state
from flexarm_bringup.sim.motor_side import MotorSide
from flexarm_bringup.sim.rig import Rig
from flexarm_controller.controller import Controller
from flexarm_controller.guard import Guard, GuardState
from flexarm_controller.guard_settings import GuardSettings, guard_limits
from flexarm_controller.limits import limits_of
from flexarm_controller.reference import Reference
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_estimator.estimator import Estimator
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.motion.profiles import Quintic
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.served.linearize import linearize
from flexarm_model.served.state_space import discretize, state_space
from flexarm_model.tree.reduced_tree import ReducedTree

HZ = 2 * np.pi  # rad/s
BEGIN = 0.5  # s of rest before the motion, in which the estimator settles
SESSION = 1  # that commands quote


def frequencies() -> dict[str, float]:
    """Return the first frequency of the strip alone, of two models, and with the motor free [Hz]."""
    config = load_config(find_manipulator("single_link"), preset="geared")
    strip = reduce_body(config.bodies["strip"], ["root", "tip"])  # a superelement, clamped at its root
    model = linearize(ReducedTree(config), config.home)  # M, D, K and outputs at a pose
    segments = SegmentTree(config, 16)  # the second model: rigid segments and springs
    step = discretize(state_space(model, force_psd=np.zeros(model.n)), 1.0 / config.rate_hz)
    poles = np.log(np.linalg.eigvals(step.A)) * config.rate_hz  # [rad/s]
    return {
        "strip_hz": float(strip.omega[0] / HZ),
        "model_hz": float(model.omega[0] / HZ),
        "segments_hz": float(segments.locked_frequencies(segments.settle(config.home), 1)[0] / HZ),
        "free_hz": float(min(abs(pole) for pole in poles if abs(pole.imag) > 1.0) / HZ),
    }


def turn(angle_deg: float = 10.0, seconds: float = 2.5) -> dict[str, float]:
    """Turn the single link on the simulated rig; return how far its axis and its tip are from the goal."""
    config = load_config(find_manipulator("single_link"), preset="geared")
    tree = ReducedTree(config)
    model, rig, motors = linearize(tree), Rig(config), MotorSide(config, 1.0 / config.rate_hz)
    estimator = Estimator(model, tree, config.sensors, EstimatorConfig())
    law, weights = ControllerConfig(period=rig.dt), MpcConfig(delay_periods=1, time_limit=0.0)
    controller = Controller(model, limits_of(config), law, weights, arm=config)
    guard = Guard(guard_limits(config, tree, GuardSettings()))

    goal, profile = np.radians(angle_deg), Quintic(np.radians(angle_deg), 1.0)
    times = np.arange(0.0, 1.0 + rig.dt, rig.dt)
    asked = Reference(BEGIN + times, *(column[:, None] for column in profile.sample(times)))
    refused = controller.follow(asked)
    if refused or not guard.arm(0.0, SESSION):
        raise ValueError(refused or guard.unready())

    samples, tau, acted = rig.observe(), np.array(guard.holding), np.zeros(1)
    for k in range(round(seconds / rig.dt)):
        t = rig.time_of(rig.tick)
        heard = [Measurement(s.sensor, rig.time_of(s.tick, s.late_ns), s.y) for s in samples]
        command = controller.step(arm_state(estimator.step(heard, acted, t)))
        motors.update(samples)
        measured = GuardState(tuple(motors.velocity), tuple(motors.position))
        samples, acted = rig.step(tau), tau  # the period passes under the torque chosen before
        tau = np.array(guard.step(command.for_guard(k, SESSION), measured, rig.time_of(rig.tick)))
    truth = rig.truth()
    x, y = truth.tip[:2]
    return {
        "axis_off_deg": float(np.degrees(truth.theta[0] - goal)),
        "tip_off_mm": float(1e3 * np.hypot(x, y) * (np.arctan2(y, x) - goal)),
        "stopped": float(guard.reason != ""),
    }


def main() -> dict[str, float]:
    """Return all figures."""
    return {**frequencies(), **turn()}


if __name__ == "__main__":
    for name, value in main().items():
        print(f"{name:14} {value:9.4f}")
