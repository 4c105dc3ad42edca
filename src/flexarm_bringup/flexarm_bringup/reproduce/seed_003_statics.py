"""Seed 003: what the robot weighs, resists and gives, against the values of the notes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_bringup.reproduce.seed_003_data import FLANGE, POSES, model_at, robot
from flexarm_model.bodies.model_order import with_rigid_beams
from flexarm_model.manipulator.body_spec import RigidBody

Array = NDArray[np.float64]

Values = dict[str, tuple[float, ...]]

COMPLIANCE: Values = {  # um/N along x, y, z; seed 003, section 4, as all below
    "home": (1.37, 4.37, 3.94),
    "mid": (0.99, 4.15, 4.00),
    "stretched": (0.74, 5.88, 5.17),
}
GRAVITY: Values = {  # N m
    "home": (0.0, -346.0, -346.0, 0.0, -38.0, 0.0),
    "mid": (0.0, -703.0, -328.0, -20.0, -46.0, -9.0),
    "stretched": (0.0, -1112.0, -344.0, 0.0, -39.0, 0.0),
}
INERTIA: Values = {  # kg m^2
    "home": (55.7, 126.8, 37.7, 0.78, 1.48, 0.25),
    "mid": (98.9, 109.9, 35.9, 1.06, 1.46, 0.25),
    "stretched": (183.5, 148.5, 38.6, 0.27, 1.48, 0.25),
}
QUANTITIES = {  # golden values, half the last printed digit above and below 10, bound [%]
    "compliance [µm/N]": (COMPLIANCE, (0.005, 0.005), 1.0),
    "gravity torque [N·m]": (GRAVITY, (0.5, 0.5), 0.5),
    "link-side inertia [kg·m²]": (INERTIA, (0.05, 0.005), 0.5),
}
MASSES = (259.8, 49.2)  # kg: all without payload, base


def static_table() -> tuple[Table, list[Check]]:
    """Return compliance of the flange, gravity torques and inertia at the links' side."""
    ours = {pose: dict(zip(QUANTITIES, _statics(pose), strict=True)) for pose in POSES}
    rows: list[Cells] = []
    checks = _mass_checks()
    for quantity, (golden, half_digits, bound) in QUANTITIES.items():
        worst = 0.0
        for i, name in enumerate("xyz" if golden is COMPLIANCE else "123456"):
            cells: Cells = [f"{quantity} {name}"]
            for pose in POSES:
                wanted, found = golden[pose][i], float(ours[pose][quantity][i])
                worst = max(worst, _unexplained(found, wanted, half_digits))
                cells += [wanted, found + 0.0]
            rows.append(cells)
        checks.append(Check(quantity, f"≤ {bound} %", f"{worst:.2f} %", worst <= bound))
    columns = [Column("quantity")]
    for pose in POSES:
        columns += [Column(f"{pose}\nnotes", ".4g"), Column("\nours", ".4g")]
    notes = [
        "Gravity torque: slope of the potential energy. Bounds apply beyond half of the last printed digit."
    ]
    return Table("Flange compliance, gravity torques, inertia", columns, rows, notes), checks


def _mass_checks() -> list[Check]:
    rigid = with_rigid_beams(robot()).bodies
    mass = {name: body.mass for name, body in rigid.items() if isinstance(body, RigidBody)}
    found = (sum(mass.values()) - mass["payload"], mass["base"])
    good = [round(value, 1) for value in found] == list(MASSES)
    return [
        Check(
            "mass without payload, of the base",
            "{} / {} kg".format(*MASSES),
            "{:.2f} / {:.2f} kg".format(*found),
            good,
        )
    ]


def _statics(pose: str) -> tuple[Array, Array, Array]:
    flexible, rigid = model_at("full", pose), model_at("rigid", pose)
    rows = flexible.node_rows(FLANGE)[:3, ~flexible.B.any(axis=1)]
    rotors = np.array([axis.rotor_inertia for axis in robot().actuated.values()])
    compliance = np.diag(rows @ np.linalg.solve(flexible.locked()[2], rows.T))
    gravity, M = rigid.B.T @ rigid.gravity_force, rigid.B.T @ rigid.M @ rigid.B
    return 1e6 * compliance, np.where(abs(gravity) > 1e-9, gravity, 0.0), np.diag(M) - rotors


def _unexplained(found: float, printed: float, half_digits: tuple[float, float]) -> float:
    """Return the relative error that half of the last printed digit does not explain [%]."""
    beyond = max(abs(found - printed) - half_digits[0 if abs(printed) >= 10 else 1], 0.0)
    return 100 * beyond / max(abs(printed), half_digits[1])
