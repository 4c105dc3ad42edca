"""Rows about stopping: at any instant, and at the end of an axis' range; rig and guard, no estimator."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.fault_drill.controller_stand import ControllerStand
from flexarm_bringup.fault_drill.drive_time import driven_periods, last_period, until_braked, until_undriven
from flexarm_bringup.fault_drill.findings import Finding
from flexarm_bringup.fault_drill.motion_record import drive_state
from flexarm_bringup.fault_drill.push_rows import pushed_at_once
from flexarm_bringup.fault_drill.row import Row
from flexarm_bringup.fault_drill.stand import Skipped
from flexarm_bringup.sim.hardware import Hardware
from flexarm_controller.controller import Controller
from flexarm_controller.guard import ARMED, STOPPED, GuardCommand
from flexarm_controller.reference import hold
from flexarm_model.tree.closure_error import ClosureError

Array = NDArray[np.float64]
STOPS, PRESSED = 200, 50  # the others the guard stops by itself; at least
LED = (
    1.0,
    0.5,
)  # of the velocity limit, in turn: at all of it many an axis becomes too fast before the button
WATCH, REST = 1.5, 10.0  # s that a stop is recorded, and that it may take; only its modes ring so long
HANG = 0.04  # s for which a controller that hangs is silent already when the stop comes
FAST = 0.25  # of the velocity limit
SPEEDS = (0.3, 0.6, 1.0)  # of the velocity limit
APPROACH = 1.5  # times the time from one end of the range to the other at that speed
STIFF = 20.0  # 1/s; of the loop that keeps the speed


@dataclass(frozen=True)
class Stop:
    """One stop, from the last period before it on.

    Attributes:
        theta, theta_dot, tau: Of every period, (k, n_theta); torque beyond what holds the arm.
        braked: What acts is the guard's own torque, not one that a command asked for, (k,).
        kept: The guard passed nothing and armed itself never.
        rested: It came to rest.
    """

    theta: Array
    theta_dot: Array
    tau: Array
    braked: NDArray[np.bool_]
    kept: bool
    rested: bool


def stops(stand: ControllerStand) -> list[Finding]:
    """Press stop at random instants of fast moves, every second time with a controller that hangs."""
    rng = np.random.default_rng(stand.seed)
    hardware, done = _at_start(stand), []
    controllers = [_controller(stand, share) for share in LED]
    for k in range(STOPS):
        hardware = hardware if hardware.guard.mode == STOPPED else _at_start(stand)
        done.append(_stop(stand, hardware, controllers[k // 2 % len(LED)], rng, bool(k % 2), k + 1))
    velocity = stand.limits.velocity
    a = np.array(hardware.guard.limits.braking.deceleration)
    v = np.array([abs(stop.theta_dot[0]) for stop in done])
    way = np.array([_way(stop) for stop in done])
    rest = hardware.guard.limits.rest_velocity
    pressed = [stop for stop in done if not stop.braked[0]]
    obeyed = stand.dt * np.array([last_period(~stop.braked) for stop in pressed])
    driven = stand.dt * np.array(
        [driven_periods((s.tau * s.theta_dot).sum(axis=1), s.theta_dot, rest) for s in done]
    )
    fast = v >= FAST * velocity
    which = f"{fast.sum()} axes from {FAST:g} v_max on"
    return [
        Finding(f"stops that did not stay, of {STOPS}", sum(not stop.kept for stop in done), 0),
        Finding("stops that did not come to rest", sum(not stop.rested for stop in done), 0),
        Finding(f"of {STOPS} by the button, the others by the guard", len(pressed), PRESSED, at_least=True),
        *until_braked(obeyed, stand.dt),
        *until_undriven(driven),
        Finding(f"way / (v^2 / 2 a), {which}", _largest(way * 2 * a / v**2, fast), 1.05),
    ]  # fmt: skip


def ends_of_ranges(stand: ControllerStand) -> list[Finding]:
    """Drive every axis towards both ends of its range at full speed, and go on pushing; then all at once."""
    beyond = pushing = 0.0
    reached, unseen = 0, 0
    low, high = stand.limits.position_low, stand.limits.position_high
    for axis in np.flatnonzero(np.isfinite(low) & np.isfinite(high)):
        for towards in (-1.0, 1.0):
            for speed in SPEEDS:
                try:
                    theta, tau, stopped = _approach(stand, int(axis), towards * speed)
                except ClosureError:  # the other limbs end the motion before the range does
                    continue
                reached += 1
                end = high[axis] if towards > 0.0 else low[axis]
                out = towards * (theta - end)
                beyond = max(beyond, float(out.max()) / (high[axis] - low[axis]))
                outward = towards * tau[out >= 0.0] / stand.limits.effort[axis]
                pushing = max(pushing, float(outward.max(initial=0.0)))
                unseen += not stopped
    if not reached:
        raise Skipped("the mechanism ends every motion before the range of an axis does")
    return [
        Finding("beyond the end / range", 100.0 * beyond, 0.5, "%"),
        Finding("outward torque at the end / limit", pushing, 1e-9),
        Finding(f"approaches that the guard did not stop, of {reached}", unseen, 0),
        *pushed_at_once(stand, _at_start(stand)),
    ]


def _at_start(stand: ControllerStand) -> Hardware:
    """Return the hardware at rest where it starts."""
    hardware = Hardware(stand.loop.config, stand.hardware.rig.settings, plant=stand.hardware.rig.plant)
    hardware.observe()
    return hardware


def _controller(stand: ControllerStand, share: float) -> Controller:
    """Return one that leads the axes at a share of their velocity limits."""
    limits = replace(stand.limits, velocity=share * stand.limits.velocity)
    return Controller(stand.model, limits, replace(stand.config, law="pd"))


def _stop(
    stand: ControllerStand,
    hardware: Hardware,
    controller: Controller,
    rng: np.random.Generator,
    hangs: bool,
    token: int,
) -> Stop:
    """Start a move to somewhere, stop it at a random instant, wait for rest."""
    guard = hardware.guard
    controller.reset()
    guard.arm(hardware.t, token)
    controller.follow(hold(_goal(stand, rng)))
    periods = int(rng.integers(round(0.05 / stand.dt), round(0.5 / stand.dt)))
    silent = int(rng.integers(1, round(HANG / stand.dt))) if hangs else 0
    for k in range(periods):
        hardware.choose_torque(
            None if k >= periods - silent else _command(hardware, controller, stand, k, token)
        )
        if guard.mode != ARMED:  # it was quicker than the button: a strain, say
            break
        hardware.advance()
    else:
        hardware.choose_torque(None if hangs else _command(hardware, controller, stand, periods, token))
    passed, rows, kept, braked = guard.passed, [], True, [guard.mode != ARMED]
    guard.stop("button")
    for k in range(round(WATCH / stand.dt)):
        driving = np.array(hardware.tau) - guard.holding
        rows.append((hardware.motors.theta.copy(), hardware.motors.theta_dot.copy(), driving))
        hardware.advance()
        hardware.choose_torque(
            None if hangs else _command(hardware, controller, stand, periods + k + 1, token)
        )
        kept &= guard.mode != ARMED and guard.passed == passed
        braked.append(guard.mode != ARMED and not hardware.is_commanded)
        if guard.mode == STOPPED:
            break
    theta, theta_dot, tau = (np.array(part) for part in zip(*rows, strict=True))
    for _ in range(round(REST / stand.dt)):
        if guard.mode == STOPPED:
            break
        hardware.advance()
        hardware.choose_torque(None)
    own = np.array(braked[: len(rows)])
    return Stop(theta, theta_dot, tau, own, kept, guard.mode == STOPPED)


def _command(
    hardware: Hardware, controller: Controller, stand: ControllerStand, k: int, token: int
) -> GuardCommand:
    state = drive_state(hardware.motors, stand.model, hardware.t)
    return GuardCommand(hardware.t, k, token, tuple(map(float, controller.step(state).tau)))


def _goal(stand: ControllerStand, rng: np.random.Generator) -> Array:
    """Return where some instant of the task leads."""
    return stand.loop.course.reference.position(rng.uniform(0.0, stand.loop.course.end))


def _largest(ratio: Array, where: NDArray[np.bool_]) -> float:
    """Return the largest where there are any; without one nothing has been shown."""
    return float(ratio[where].max(initial=0.0)) if where.any() else np.inf


def _way(stop: Stop) -> Array:
    """Return how far each axis went on in its direction [rad] or [m], (n_theta,)."""
    onward = np.sign(stop.theta_dot[0]) * (stop.theta - stop.theta[0])
    return np.asarray(onward.max(axis=0))


def _approach(stand: ControllerStand, axis: int, speed: float) -> tuple[Array, Array, bool]:
    """Return position and torque of an axis driven at a share of its speed limit, and if it was stopped.

    The torque that is returned is that beyond what holds the arm, and so is the one that drives it.
    """
    hardware = _at_start(stand)
    guard, limits = hardware.guard, stand.limits
    guard.arm(0.0, 1)
    wanted, inertia = np.zeros(stand.model.n_theta), np.diag(stand.model.M)[: stand.model.n_theta]
    wanted[axis] = speed * limits.velocity[axis]
    span = limits.position_high[axis] - limits.position_low[axis]
    rows, stopped = [], False
    for k in range(round(APPROACH * span / abs(wanted[axis]) / stand.dt)):
        push = guard.holding + STIFF * inertia * (wanted - hardware.motors.theta_dot)
        hardware.choose_torque(GuardCommand(hardware.t, k, 1, tuple(map(float, push))))
        rows.append((hardware.rig.plant.theta[axis], hardware.tau[axis] - guard.holding[axis]))
        stopped |= guard.mode != ARMED
        hardware.advance()
    theta, tau = (np.array(part) for part in zip(*rows, strict=True))
    return theta, tau, stopped


ROWS = (
    Row(53, "stop at 200 random instants", "stays; braked; stops within its way", stops),
    Row(54, "end of the range at full speed", "guard stops before it; nothing pushes beyond", ends_of_ranges),
)
