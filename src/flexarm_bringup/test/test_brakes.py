"""An arm with weight does not drop as its brakes open, nor sink when they close as its guard was killed."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from flexarm_bringup.sim.drives import Drives, drive_limits
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_controller.drives.watchdog import DriveWatchdog
from flexarm_controller.guarding.hold_rate import HoldRate
from flexarm_controller.guarding.pose_loads import PoseLoads, loads_of
from flexarm_controller.limits import limits_of
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize

Array = NDArray[np.float64]
CRANE = Path(__file__).parent / "arms" / "crane.yaml"
SILENCE, BRAKE_TIME = 0.05, 0.1  # s
RATE = 8.0  # 1/s; of the law that moves the arm
RISE, KILLED, END = 0.4, 0.6, 2.4  # s
MOVES = {  # velocities of the axes over their limits; an arm with weight is led downwards
    "variable_stiffness": (0.0, -0.3, 0.1),
    "serial_6r": (0.1, 0.2, 0.1, 0.1, 0.1, 0.1),
    "single_link": (0.6,),
    "spatial_3tpt": (0.6, 0.6, 0.6),
}


class Killed:
    """A run in which the drives hear of a guard until an instant, in a move, and of nobody from then on."""

    def __init__(self, name: str, move: tuple[float, ...], has_brakes: bool = True) -> None:
        config = load_config(find_manipulator(name))
        self.drives = Drives(config, RigSettings())
        rig = self.drives.rig
        self.limits = drive_limits(config, rig, SILENCE, BRAKE_TIME)
        self._watchdog, self._has_brakes = DriveWatchdog(self.limits), has_brakes
        self._watchdog.attach()
        self._watchdog.open_brakes()
        self.drives.open_brakes()
        tree = rig.plant.tree
        self._loads, self._follow = (
            loads_of(tree, linearize(tree)),
            PoseLoads(tree, HoldRate(rig.dt, 0.4, 1.0)),
        )
        self._v = np.array(move) * [axis.velocity for axis in config.actuated.values()]
        self._theta = self.drives.own.theta
        self.closed: float | None = None
        self.told = np.array([self._step(k * rig.dt) for k in range(round(END / rig.dt))])
        after, last = self.told[round(KILLED / rig.dt)], self.told[-1]
        with_them = "with" if has_brakes else "without"
        print(
            f"{name} {with_them} brakes: {after[1]:.2f} rad/s or m/s when killed, "
            f"sinks {1e3 * self.drop:.1f} mm, then {last[1]:.2f}, strain / limit {self.told[:, 2].max():.2f}"
        )

    def _step(self, t: float) -> Array:
        """Go on by a period; return height and largest speed of an axis [SI], and strain over limit [1]."""
        drives, rig = self.drives, self.drives.rig
        drives.tau = self._watchdog.step(self._effort(t) if t < KILLED else None, drives.state().velocity)
        if self._watchdog.are_brakes_closed and self._has_brakes:
            drives.close_brakes()
            self.closed = t if self.closed is None else self.closed
        drives.advance()
        truth = rig.truth()
        strain = abs(truth.strain) / limits_of(rig.config).strain
        return np.array([truth.tip[2], abs(truth.theta_dot).max(), *strain.max(initial=0.0, keepdims=True)])

    def _effort(self, t: float) -> list[float]:
        """Return the torque that leads the arm on."""
        own, dt = self.drives.own, self.drives.rig.dt
        self._loads = self._follow.look(own.position) or self._loads
        v = self._v * min(1.0, t / RISE)
        self._theta = self._theta + v * dt
        push = RATE * (v - own.theta_dot) + RATE**2 / 4.0 * (self._theta - own.theta)
        turning = self._loads.changing(push.tolist())
        return [h + tau for h, tau in zip(self._loads.holding_at(own.position), turning, strict=True)]

    @property
    def drop(self) -> float:
        """By how much the tip sank from the kill on at most [m]."""
        after = self.told[round(KILLED / self.drives.rig.dt) :, 0]
        return float(after[0] - after.min())


@cache
def killed(name: str) -> Killed:
    return Killed(name, MOVES[name])


def test_an_arm_with_weight_does_not_drop_when_its_brakes_open() -> None:
    hardware = Hardware(load_config(CRANE))
    hardware.observe()
    assert hardware.guard.arm(0.0, 1)
    tips = []
    for _ in range(4):
        hardware.advance()
        hardware.choose_torque(None)
        tips.append(hardware.rig.plant.tip_pose()[:3, 3])
    fallen = np.linalg.norm(tips[-1] - tips[0])
    print(f"after 4 periods the tip is {1e6 * fallen:.3f} um off")
    assert fallen < 0.01 * 9.81 * (3 * hardware.dt) ** 2 / 2  # of a free fall


def test_an_arm_with_weight_sinks_by_a_centimetre_when_its_guard_is_killed_in_a_move() -> None:
    """It goes down at 0.7 rad/s: 10.5 mm; without brakes it falls until it hangs, 0.6 m in 1.8 s."""
    assert killed("variable_stiffness").drop < 0.015
    assert Killed("variable_stiffness", MOVES["variable_stiffness"], has_brakes=False).drop > 0.5


@pytest.mark.slow
def test_a_heavy_arm_that_goes_down_at_a_metre_per_second_sinks_by_two_decimetres() -> None:
    """171 mm of tip at 0.56 rad/s; without brakes 692 mm in 1.8 s, and on at 0.23 rad/s."""
    assert killed("serial_6r").drop < 0.2
    assert Killed("serial_6r", MOVES["serial_6r"], has_brakes=False).drop > 0.6


@pytest.mark.slow
def test_a_heavy_arm_that_stands_sinks_by_a_centimetre() -> None:
    assert Killed("serial_6r", (0.0,) * 6).drop < 0.015


ARMS = [
    "variable_stiffness",
    "single_link",
    *(pytest.param(n, marks=pytest.mark.slow) for n in ("serial_6r", "spatial_3tpt")),
]


@pytest.mark.parametrize("name", ARMS)
def test_brakes_close_in_time_and_then_the_axes_stand_and_no_gauge_is_strained_too_much(name: str) -> None:
    run = killed(name)
    dt = run.drives.rig.dt
    assert run.closed is not None and run.closed <= KILLED + SILENCE + BRAKE_TIME + 2.0 * dt
    still = run.told[round((run.closed + 0.25) / dt) :]
    assert still[:, 1].max() < 1e-9
    assert run.told[:, 2].max() < 1.0


def test_what_links_swing_when_the_brakes_have_closed_dies_away() -> None:
    """Motors that stand do not make links stand: they ring on, and by their own damping less and less."""
    run = killed("single_link")
    assert run.closed is not None
    strains = run.told[round((run.closed + 0.1) / run.drives.rig.dt) :, 2]
    third = len(strains) // 3
    first, last = strains[:third].max(), strains[-third:].max()
    assert 0.0 < last < 0.8 * first


def test_a_rig_whose_brakes_have_never_been_open_stands_still_to_the_bit() -> None:
    drives = Drives(load_config(find_manipulator("single_link")))
    before = drives.rig.plant.q.copy()
    drives.observe()
    drives.close_brakes()
    for _ in range(10):
        drives.tau = [5.0]
        drives.advance()
    assert (drives.rig.plant.q == before).all() and drives.rig.tick == 10


def test_brakes_that_open_again_let_the_arm_move() -> None:
    drives = Drives(load_config(find_manipulator("single_link")))
    drives.open_brakes()
    for is_open in (True, False, True):
        (drives.open_brakes if is_open else drives.close_brakes)()
        drives.tau = [5.0]
        for _ in range(40):
            drives.advance()
        assert (abs(drives.rig.plant.theta_dot[0]) > 0.1) == is_open


def strain_of_silence(has_brakes: bool) -> float:
    """Push planar_3rrr for 0.1 s, be silent for 0.6 s; return the largest strain since, over its limit."""
    config = load_config(find_manipulator("planar_3rrr"), "geared")
    drives = Drives(config)
    drives.observe()
    limits, told = drive_limits(config, drives.rig, SILENCE, BRAKE_TIME), []
    watchdog = DriveWatchdog(limits)
    watchdog.attach()
    watchdog.open_brakes()
    drives.open_brakes()
    push = [share * most for share, most in zip((0.1, -0.1, 0.05), limits.effort, strict=True)]
    for k in range(140):
        drives.tau = watchdog.step(push if k < 20 else None, drives.state().velocity)
        if has_brakes and watchdog.are_brakes_closed:
            drives.close_brakes()
        drives.advance()
        told.append(abs(drives.rig.truth().strain) / limits_of(config).strain)
    return float(np.max(told[20:]))


@pytest.mark.slow
def test_brakes_strain_links_little_more_than_the_damping_before_them() -> None:
    """From 1.6 rad/s: 0.73 of the limit by damping alone, 0.90 with brakes; axes that stand damp not."""
    damped, braked = (strain_of_silence(has_brakes) for has_brakes in (False, True))
    assert 0.6 < damped < braked < 0.95
