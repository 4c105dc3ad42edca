"""Seed 004: ramps of the servos and what the links on their springs make of them.

    tau = k (q_cmd - q) - c (q' - q_cmd') + G(q)

The servos follow their ramps exactly and carry gravity, so what is left to integrate is the links about
the commanded angles: the product's reduced tree without gravity, its servos' coordinates prescribed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.reproduce.seed_004_data import END_DEG, START_DEG, Film, arm_config
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]

STEP = 1e-3  # s; the fastest pole of the links decays at 500 /s
END = 7.6  # s, after the last sample and its oscillation
AT_ONCE = 1e9  # deg/s, a step


@dataclass(frozen=True)
class Ramp:
    """A joint goes from one angle to another [deg] at a rate [deg/s] from a time on [s]."""

    first: float
    last: float
    rate: float
    start: float

    def at(self, t: float) -> tuple[float, float]:
        """Return angle [deg] and velocity [deg/s]."""
        travel, sign = abs(self.last - self.first), np.sign(self.last - self.first)
        gone = self.rate * (t - self.start)
        is_moving = 0.0 <= gone < travel
        return self.first + sign * min(max(gone, 0.0), travel), sign * self.rate if is_moving else 0.0


Ramps = Sequence[Ramp]  # of base, shoulder and elbow


def make_ramps(rates: Sequence[float], starts: Sequence[float]) -> list[Ramp]:
    """Return the published three moves with the given rates [deg/s] and starts [s], of joints 1 to 3."""
    return [Ramp(*ends) for ends in zip(START_DEG, END_DEG, rates, starts, strict=True)]


@dataclass(frozen=True)
class Record:
    """Link angles over time: t [s], (k,); q [deg], (k, 3)."""

    t: Array
    q_deg: Array

    def at(self, t: Array) -> Array:
        """Return the angles [deg] at other times [s], (m, 3)."""
        return np.column_stack([np.interp(t, self.t, angle) for angle in self.q_deg.T])


def follow_exactly(ramps: Ramps) -> Record:
    """Return what a rigid arm does."""
    t: Array = np.linspace(0.0, END, round(END / STEP) + 1)
    return Record(t, np.array([[ramp.at(float(now))[0] for ramp in ramps] for now in t]))


class SpringArm:
    """The links about the angles that ideal servos command, gravity carried by these."""

    def __init__(self, preset: str = "", *, damps_spring_rate: bool = True) -> None:
        """Prepare the equations.

        Args:
            preset: Of the manipulator's file.
            damps_spring_rate: Whether damping acts on the springs' rates, else on the links' own.
        """
        self.tree = ReducedTree(replace(arm_config(preset), gravity=np.zeros(3)))
        self._servos, self._motion = self.tree.actuated, self.tree.functions["motion"]
        self._springs = [i for i in range(self.tree.n_q) if i not in self._servos]
        damping = np.array([self.tree.axes[i].damping for i in self._springs])
        self._command_damping = np.zeros(3) if damps_spring_rate else damping
        self._inner = np.ix_(self._springs, self._springs)

    def follow(self, ramps: Ramps) -> Record:
        """Integrate from rest (Runge-Kutta of order four) and return the links' angles."""
        q = np.radians([ramp.first for ramp in ramps])
        v, h = np.zeros(3), STEP
        angles = [q]
        for i in range(round(END / h)):
            now, half, new = (self._command(ramps, (i + part) * h) for part in (0.0, 0.5, 1.0))
            k1 = self._accelerate(now, q, v)
            k2 = self._accelerate(half, q + h / 2 * v, v + h / 2 * k1)
            k3 = self._accelerate(half, q + h / 2 * (v + h / 2 * k1), v + h / 2 * k2)
            k4 = self._accelerate(new, q + h * (v + h / 2 * k2), v + h * k3)
            q, v = q + h * v + h**2 / 6 * (k1 + k2 + k3), v + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
            angles.append(q)
        return Record(np.linspace(0.0, END, len(angles)), np.degrees(angles))

    def _command(self, ramps: Ramps, t: float) -> Array:
        """Return angles [rad] and velocities [rad/s] of the servos, (2, 3)."""
        return np.asarray(np.radians(np.array([ramp.at(t) for ramp in ramps])).T)

    def _accelerate(self, command: Array, q: Array, v: Array) -> Array:
        """Return the links' accelerations [rad/s^2] at their angles and velocities, (3,) each."""
        full_q, full_v = np.empty(self.tree.n_q), np.empty(self.tree.n_q)
        full_q[self._servos], full_q[self._springs] = command[0], q - command[0]
        full_v[self._servos], full_v[self._springs] = command[1], v - command[1]
        M, force = self._motion(full_q, full_v)
        return np.linalg.solve(M[self._inner], -force[self._springs] - self._command_damping * command[1])


def fit_lines(film: Film, angle: Array) -> list[Ramp]:
    """Return the ramps through straight lines (least squares) over the samples of each move.

    Args:
        film: When which joint was seen.
        angle: Of the joint that moves [deg], (k,).
    """
    ramps = []
    for joint, (first, last) in enumerate(zip(START_DEG, END_DEG, strict=True)):
        seen = film.joint == joint
        slope, offset = np.polyfit(film.t[seen], angle[seen], 1)
        ramps.append(Ramp(first, last, abs(float(slope)), float((first - offset) / slope)))
    return ramps
