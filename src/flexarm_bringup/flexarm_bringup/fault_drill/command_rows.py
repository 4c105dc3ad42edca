"""Rows about commands and references: too large, malformed, jumping, outside the limits."""

from __future__ import annotations

import math
import random
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.fault_drill.controller_stand import ControllerStand, state_of, with_law
from flexarm_bringup.fault_drill.findings import ROUNDED, Finding
from flexarm_bringup.fault_drill.row import Row
from flexarm_controller.guard import BRAKING, Guard, GuardCommand, GuardState
from flexarm_controller.limits import Limits
from flexarm_controller.motion.admission import admit
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.mpc import Plan
from flexarm_controller.reference import Reference, hold
from flexarm_controller.solvers.qp import QpResult
from flexarm_controller.state import ArmState

Array = NDArray[np.float64]
COMMANDS = 1_000_000
THROUGH_CONTROLLER = 20_000  # of them; the others are random as they reach the guard
FUZZED = 10_000
DEMAND = 5.0  # times the torque there is
NEAR = 0.02  # of a move: within it the axes have arrived
WATCHED = 3.0  # times the first move and the rest after it
REFERENCES = 300


def saturated(stand: ControllerStand) -> list[Finding]:
    """Demand five times the torque, at random and by a move."""
    rng = np.random.default_rng(stand.seed)
    limits, dt, n = stand.limits, stand.dt, stand.model.n_theta
    guard = Guard(stand.guard_limits)
    guard.arm(0.0, 1)
    before = np.array([guard.holding])  # the motors bear the arm until the first command
    still = GuardState((0.0,) * n, tuple(map(float, stand.loop.course.home)))
    wanted = DEMAND * limits.effort * rng.standard_normal((COMMANDS, n))
    controlled = _through_controller(stand, wanted[:THROUGH_CONTROLLER])
    efforts = np.vstack([controlled, wanted[THROUGH_CONTROLLER:]]).tolist()
    out = np.array(
        [guard.step(GuardCommand(k * dt, k, 1, tuple(e)), still, k * dt) for k, e in enumerate(efforts)]
    )
    over = (abs(out) > limits.effort).sum()
    steps = abs(np.diff(out, axis=0, prepend=before)) / (limits.effort_rate * dt)
    own = abs(np.diff(controlled, axis=0, prepend=stand.holding[None])) / (limits.effort_rate * dt)
    return [
        Finding(f"torques beyond the limit, of {COMMANDS:,} commands", int(over), 0),
        Finding("torque steps beyond the rate limit", int((steps > ROUNDED).sum()), 0),
        Finding("steps of the controller's own torques beyond it", int((own > ROUNDED).sum()), 0),
        Finding("commands not let through", COMMANDS - guard.passed, 0),
        _settling(stand),
    ]


def malformed(stand: ControllerStand) -> list[Finding]:
    """Send the armed guard commands that cannot be meant."""
    rng, limits = random.Random(stand.seed), stand.guard_limits
    n, dt = len(limits.effort), limits.period
    moving = GuardState(tuple(0.02 for _ in range(n)), tuple(map(float, stand.loop.course.home)))
    unlatched = unsafe = 0
    for _ in range(FUZZED):
        guard = Guard(limits)
        guard.arm(0.0, 1)
        sound = tuple(rng.uniform(-e, e) for e in limits.effort)
        last = guard.step(GuardCommand(0.0, 1, 1, sound), moving, 0.0)
        torque = guard.step(GuardCommand(dt, 2, 1, _nonsense(rng, n)), moving, dt)
        unlatched += guard.mode != BRAKING or guard.token != 0
        unsafe += not all(
            math.isfinite(now) and abs(now) <= most and abs(now - before) <= rate * dt * ROUNDED
            for now, before, most, rate in zip(torque, last, limits.effort, limits.effort_rate, strict=True)
        )
    return [
        Finding(f"faults not latched in the same cycle, of {FUZZED:,}", unlatched, 0),
        Finding("torques that were not finite or beyond a limit", unsafe, 0),
    ]


def jumping(stand: ControllerStand) -> list[Finding]:
    """Give references outside the limits, and such that jump, while the arm follows its task."""
    rng, limits = np.random.default_rng(stand.seed), stand.limits
    controller = stand.controller()
    list(stand.follow(controller, 2))
    taken = silent = 0
    for _ in range(REFERENCES):
        theta, theta_dot = _outside(rng, stand)
        reference = Reference(np.array([0.0, 1.0]), theta, theta_dot, np.zeros_like(theta))
        reason = controller.follow(reference)
        taken += not reason
        silent += bool(reason) and not any(name in reason for name in stand.model.theta_names)
    return [
        Finding(f"references outside the limits that were taken, of {REFERENCES}", taken, 0),
        Finding("refusals that do not name the axis", silent, 0),
        Finding(
            "step of a reference that jumps / v_max T", _largest_step(stand, rng, limits.velocity), ROUNDED
        ),
    ]


def _through_controller(stand: ControllerStand, wanted: Array) -> Array:
    law = _Random(wanted)
    controller = with_law(stand.controller(), law)
    model, n = stand.model, stand.model.n_theta
    still = state_of(model, np.concatenate([stand.loop.course.home, np.zeros(2 * model.n - n)]), 0.0)
    return np.array([controller.step(replace(still, t=k * stand.dt)).tau for k in range(len(wanted))])


class _Random:
    """A law that asks for given torques."""

    def __init__(self, wanted: Array) -> None:
        self._wanted = iter(wanted)

    def step(self, state: ArmState, reference: Reference, sent: Array) -> Plan:
        """Return the torque that is next."""
        torque = next(self._wanted)
        return Plan(torque[None], QpResult(torque, "", 0, 0.0, True), ())

    def work_ahead(self) -> None:
        """Do nothing; see ``Planner``."""
        pass


def _settling(stand: ControllerStand) -> Finding:
    """Compare the time that the first move takes with a fifth of the torque that it uses."""
    ratio = _arrival(stand, stand.scarce(1.0 / DEMAND)) / _arrival(stand, stand.limits)
    return Finding("time to arrive with a fifth of the torque used / with all", ratio, 2.0)


def _arrival(stand: ControllerStand, limits: Limits) -> float:
    """Return when the axes have arrived for good after the first move began [s]; infinite if never.

    The reference is that of the first move alone, as an axis that only later moves use has no torque left
    for them; it is taken as the controller's node takes it.
    """
    course, dt = stand.loop.course, stand.dt
    leg = course.legs[0]
    end = course.legs[1].start if len(course.legs) > 1 else course.end
    controller = stand.controller(limits=limits)
    followed, _ = admit(_until(course.reference, end), stand.model, limits, MotionConfig())
    controller.follow(followed)
    commands = list(stand.follow(controller, round(WATCHED * (end - leg.start) / dt)))
    goal = course.reference.position(leg.end)
    theta = [followed.position(c.t) - c.tracking_error for c in commands]
    away = np.linalg.norm(np.array(theta) - goal, axis=1)
    size = float(np.linalg.norm(goal - course.reference.position(leg.start)))
    last = int(np.flatnonzero(away > NEAR * size)[-1])
    return commands[last + 1].t - leg.start if last + 1 < len(commands) else math.inf


def _until(reference: Reference, end: float) -> Reference:
    """Return what a reference says until a time at which it rests [s]."""
    kept = reference.t <= end
    before = reference.theta_ddot_before
    return replace(
        reference,
        t=reference.t[kept],
        theta=reference.theta[kept],
        theta_dot=reference.theta_dot[kept],
        theta_ddot=reference.theta_ddot[kept],
        theta_ddot_before=None if before is None else before[kept],
    )


def _outside(rng: np.random.Generator, stand: ControllerStand) -> tuple[Array, Array]:
    """Return positions and velocities, (2, n), of which one is beyond its limit by up to its size."""
    limits, home = stand.limits, stand.loop.course.home
    n = home.size
    theta, theta_dot = np.tile(home, (2, 1)), np.zeros((2, n))
    axis, beyond = int(rng.integers(n)), float(rng.uniform(1e-6, 1.0))
    span = limits.position_high[axis] - limits.position_low[axis]
    kind = int(rng.integers(3))
    if kind == 0:
        theta[1, axis] = limits.position_high[axis] + beyond * span
    elif kind == 1:
        theta[1, axis] = limits.position_low[axis] - beyond * span
    else:
        theta_dot[:, axis] = limits.velocity[axis] * (1.0 + beyond)
    return theta, theta_dot


def _largest_step(stand: ControllerStand, rng: np.random.Generator, velocity: Array) -> float:
    """Return by how much the followed reference moves in a period at most, over what it may."""
    limits, dt = stand.limits, stand.dt
    controller = stand.controller()
    model = stand.model
    state = state_of(model, np.concatenate([model.pose, np.zeros(2 * model.n - model.n_theta)]), 0.0)
    positions, k = [], 0
    for _ in range(20):
        goal = limits.position_low + rng.random(velocity.size) * (limits.position_high - limits.position_low)
        controller.follow(hold(goal))
        for _ in range(10):
            controller.step(replace(state, t=k * dt))
            assert controller.reference is not None
            positions.append(controller.reference.position(k * dt))
            k += 1
    return float((abs(np.diff(positions, axis=0)) / (velocity * dt)).max())


def _nonsense(rng: random.Random, n: int) -> tuple[float, ...]:
    special = (math.nan, math.inf, -math.inf)
    if rng.random() < 0.5:
        length = rng.choice([k for k in range(n + 3) if k != n])
        return tuple(rng.gauss(0.0, 1.0) for _ in range(length))
    values = [rng.gauss(0.0, 1.0) for _ in range(n)]
    values[rng.randrange(n)] = rng.choice(special)
    return tuple(values)


ROWS = (
    Row(35, "five times the torque demanded", "torque and its rate within their limits; settles", saturated),
    Row(41, "command not finite or of wrong length", "safe value in the same cycle, latched", malformed),
    Row(42, "reference jumps or leaves the limits", "refused with the reason, or led", jumping),
)
