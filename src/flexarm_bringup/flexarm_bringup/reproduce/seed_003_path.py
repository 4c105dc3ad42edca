"""Seed 003, path test: how far the flange leaves the square, rigid against flexible. Directions, no sizes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_bringup.reproduce.seed_003_data import robot
from flexarm_bringup.reproduce.seed_003_lap import (
    CENTRE,
    INNER,
    PERIOD,
    Case,
    drive_lap,
    friction,
    lap,
    outside,
    rigid_torques,
    stand_on_path,
    tune_drives,
)
from flexarm_model.kinematics.joint_path import JointMotion
from flexarm_model.manipulator.description import Axis

Array = NDArray[np.float64]

NOTED = (420.0, 1310.0, 470.0, 20.0, 35.0, 5.0)  # N m, seed 003, section 2: "about"
COARSE = 10  # samples: accelerations by differences of 10 ms
FASTER = 2.0  # drives of the second reading
CASES = {
    "rigid, no friction": Case(False, False),
    "rigid, viscous friction": Case(False, True),
    "flexible, no friction": Case(True, False),
    "flexible, viscous friction": Case(True, True),
    "flexible, friction fed forward": Case(True, True, is_known=True),
    "rigid, no friction, faster drives": Case(False, False, stiffness=FASTER),
    "rigid, viscous friction, faster drives": Case(False, True, stiffness=FASTER),
    "flexible, no friction, faster drives": Case(True, False, stiffness=FASTER),
    "flexible, viscous friction, faster drives": Case(True, True, stiffness=FASTER),
}
READINGS = {  # of "with friction"
    "drives do not know it": "flexible, viscous friction",
    "fed forward": "flexible, friction fed forward",
    "not known, faster drives": "flexible, viscous friction, faster drives",
}
BARE: dict[str, Any] = {"has_friction": False, "is_known": False}
COLUMNS = (
    Column("robot"),
    *(Column(f"{head}\n[mm]", ".2f") for head in ("corners\nout", "\nin", "\nmean")),
    *(Column(f"{head}\n[mm]", ".2f") for head in ("lines\nout", "\nin", "\nmean")),
    *(Column(f"{head}\n[mm]", ".2f") for head in ("height\nlowest", "\nhighest")),
)


@dataclass(frozen=True)
class Excursion:
    """How far places lie from the path horizontally [mm].

    Attributes:
        out: Farthest outside, 0 when none is.
        inside: Farthest inside, 0 when none is.
        mean: Mean distance.
    """

    out: float
    inside: float
    mean: float

    @property
    def largest(self) -> float:
        """The larger of both."""
        return max(self.out, self.inside)


def path_section() -> tuple[list[Table], list[Check]]:
    """Return torques along the path, how far the flange leaves it, and what friction does to that."""
    return [torque_table(), deviation_table(), friction_table()], [rank_check()]


def assumed_drives() -> list[str]:
    """Return how the drives of the path test are set: assumed, like the rest of the robot."""
    rule = (
        "drives of the path test: w = slowest mode with the motors locked, K_v = w × rigid inertia in the "
        f"middle of the path, k_p = k_i = w / {INNER:g}, at {1 / PERIOD:g} Hz; torques of the rigid robot "
        "without friction fed forward"
    )
    return [rule, f"their gains, {_gains(1.0)}", f"those of the faster drives, {_gains(FASTER)}"]


def torque_table() -> Table:
    """Return the largest torques of the rigid robot on the lap beside those of the notes."""
    steady, joints = lap().is_steady, lap().joints
    still = JointMotion(joints.theta, np.zeros_like(joints.theta), joints.theta_ddot)
    own = np.array([axis.rotor_inertia for axis in _axes()]) * joints.theta_ddot
    columns = {
        "notes, about": NOTED,
        "ours": _peaks(rigid_torques(still)[steady]),
        f"differences\nof {1e3 * COARSE * PERIOD:.0f} ms": _peaks(rigid_torques(_differenced(still))),
        "without\nrotors": _peaks((rigid_torques(still) - own)[steady]),
        "with Coriolis\nterms": _peaks(rigid_torques(joints)[steady]),
        "and viscous\nfriction": _peaks((rigid_torques(joints) + friction() * joints.theta_dot)[steady]),
    }
    rows: list[Cells] = [
        [f"{i + 1}", *map(float, peaks)] for i, peaks in enumerate(zip(*columns.values(), strict=True))
    ]
    ramp = _peaks(rigid_torques(still))[0]
    notes = [
        "At full speed. Accelerations jump where a corner begins or ends: the notes' 420 would be what "
        "differences over 10 ms leave of it, their 5 a disc without its rotor.",
        f"Setting off and stopping takes more of joint 1: {ramp:.0f} N·m.",
    ]
    return Table(
        "Path test: torque peaks of the rigid robot [N·m]",
        [Column("joint"), *(Column(title, ".1f") for title in columns)],
        rows,
        notes,
    )


def deviation_table() -> Table:
    """Return the distance of the flange from the square, without and with friction."""
    rows: list[Cells] = [["flexible, standing still", *_cells(stand_on_path())]]
    rows += [[name, *_cells(drive_lap(case))] for name, case in CASES.items()]
    notes = [
        "Horizontal distance from the path: largest outside, inside, mean. Standing still: the sag alone.",
        "Drives and their gains are assumed, see below; the sizes stand for nothing.",
    ]
    return Table("Path test: deviation from the square", COLUMNS, rows, notes)


def friction_table() -> Table:
    """Return whether the flexible robot overshoots more without friction, as the paper reads its path."""
    rows: list[Cells] = [
        [reading, *(cell for bare, rubbed in pairs for cell in (bare, rubbed, bare > rubbed))]
        for reading, pairs in overshoots().items()
    ]
    columns = [Column("friction")]
    for head in ("out of the corners", "back inside after them"):
        columns += [
            Column(f"{head}\nwithout [mm]", ".3f"),
            Column("\nwith [mm]", ".3f"),
            Column("\nmore without"),
        ]
    notes = [
        "The statement: “flex overshoots more in corners (no friction)”. Here friction is viscous and of "
        "assumed size; dry friction is not in the set.",
        "Direction only: it depends on what the drives know of friction.",
    ]
    return Table("Path test: does the flexible robot overshoot more without friction?", columns, rows, notes)


def overshoots() -> dict[str, list[tuple[float, float]]]:
    """Return by reading how far the flexible robot is out of corners and back inside after them [mm].

    Each is a pair: without friction and with it.
    """
    found = {}
    for reading, name in READINGS.items():
        bare, rubbed = (excursions(drive_lap(c)) for c in (replace(CASES[name], **BARE), CASES[name]))
        found[reading] = [
            (bare["corners"].out, rubbed["corners"].out),
            (bare["lines"].inside, rubbed["lines"].inside),
        ]
    return found


def rank_check() -> Check:
    """Return whether the flexible robot is farther off than the rigid one wherever both were driven alike."""
    pairs = [(replace(case, is_flexible=False), case) for case in CASES.values() if case.is_flexible]
    farther = [
        bent.largest > stiff.largest and bent.mean > stiff.mean
        for rigid, flexible in pairs
        if rigid in CASES.values()
        for stiff, bent in zip(*(excursions(drive_lap(c)).values() for c in (rigid, flexible)), strict=True)
    ]
    wanted, found = (f"{count} of {len(farther)}" for count in (len(farther), sum(farther)))
    return Check("path: flexible farther off than rigid, corners and lines", wanted, found, all(farther))


def excursions(places: Array) -> dict[str, Excursion]:
    """Return the excursion at the corners and along the lines.

    Args:
        places: Of the flange [m], (k, 3).
    """
    off, at_corner = outside(places)
    return {
        name: Excursion(
            *(1e3 * float(x) for x in (max(part.max(), 0.0), max(-part.min(), 0.0), abs(part).mean()))
        )
        for name, part in (("corners", off[at_corner]), ("lines", off[~at_corner]))
    }


def _axes() -> list[Axis]:
    return list(robot().actuated.values())


def _peaks(torques: Array) -> Array:
    return np.asarray(abs(torques).max(axis=0))


def _differenced(motion: JointMotion) -> JointMotion:
    """Return the motion at full speed with the accelerations that coarse second differences give."""
    theta = motion.theta[lap().is_steady][::COARSE]
    bent = (theta[2:] - 2 * theta[1:-1] + theta[:-2]) / (COARSE * PERIOD) ** 2
    return JointMotion(theta[1:-1], np.zeros_like(bent), bent)


def _cells(places: Array) -> list[float]:
    found = excursions(places)
    height = 1e3 * (places[:, 2] - CENTRE[2])
    values = [x for part in found.values() for x in (part.out, part.inside, part.mean)]
    return [*values, float(height.min()), float(height.max())]


def _gains(stiffness: float) -> str:
    drives = tune_drives(stiffness)
    gains = ", ".join(f"{value:.0f}" for value in drives.K_v)
    outer = f"k_p {drives.k_p:.1f}, k_i {drives.k_i:.1f} 1/s"
    return f"w = {drives.frequency:.0f} rad/s: K_v {gains} N·m·s/rad, {outer}"
