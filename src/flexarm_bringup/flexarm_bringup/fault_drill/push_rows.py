"""All motors push at once, as a controller gone wild would: the guard's stop keeps every axis in its range.

One axis alone, with the others regulated, does not show how axes throw each other: a stop that kept them at
their velocities threw a 3RRR by 2.5 times its range at a tenth of its torque.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.fault_drill.controller_stand import ControllerStand
from flexarm_bringup.fault_drill.findings import Finding
from flexarm_bringup.sim.hardware import Hardware
from flexarm_controller.guard import ARMED, STOPPED, GuardCommand
from flexarm_model.tree.closure_error import ClosureError

Array = NDArray[np.float64]
SHARES = (0.1, 0.3, 1.0)  # of the torque limits
WAYS = 4  # in which the motors push, by chance
WITHIN = 2.0  # s that they push, stop and rest included


def pushed_at_once(stand: ControllerStand, hardware: Hardware) -> list[Finding]:
    """Push with all motors until the guard stops the arm, and go on.

    Args:
        stand: Of the controller; its seed chooses the ways.
        hardware: Rig and guard at rest where the arm starts; left where the last push ends.
    """
    low, high = stand.limits.position_low, stand.limits.position_high
    beyond, stopped = 0.0, 0
    for push in _pushes(stand):
        theta, was_stopped = _pushed(stand, hardware, push)
        with np.errstate(invalid="ignore"):  # an axis without ends is always inside
            out = np.fmax(theta - high, low - theta) / (high - low)
        beyond, stopped = max(beyond, float(np.nanmax(out, initial=0.0))), stopped + was_stopped
    what = f"pushed by all motors, {WAYS * len(SHARES)} ways"
    return [Finding(f"{what}: beyond the end / range", 100.0 * beyond, 0.5, "%"),
            Finding(f"{what}: stopped", stopped, 1, at_least=True)]  # fmt: skip


def _pushes(stand: ControllerStand) -> Iterator[Array]:
    """Give what the motors add to what holds the arm [N m] or [N], (n_theta,)."""
    rng = np.random.default_rng(stand.seed)
    for _ in range(WAYS):
        signs = rng.choice((-1.0, 1.0), stand.model.n_theta)
        yield from (share * signs * stand.limits.effort for share in SHARES)


def _pushed(stand: ControllerStand, hardware: Hardware, push: Array) -> tuple[Array, bool]:
    """Return where the axes were in every period, (k, n_theta), and whether the guard stopped them."""
    hardware = Hardware(stand.loop.config, hardware.rig.settings, plant=hardware.rig.plant)
    hardware.observe()
    guard, theta = hardware.guard, [hardware.rig.plant.theta.copy()]
    guard.arm(0.0, 1)
    while len(theta) * stand.dt < WITHIN and guard.mode != STOPPED:
        tau = np.array(guard.holding) + push
        hardware.choose_torque(GuardCommand(hardware.t, len(theta), 1, tuple(map(float, tau))))
        try:
            hardware.advance()
        except ClosureError:  # the limbs end the motion before the range does
            break
        theta.append(hardware.rig.plant.theta.copy())
    return np.array(theta), guard.mode != ARMED
