"""Seed 003: what seven or twelve modes keep of the responses: the form that estimator and controller know."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_bringup.reproduce.seed_003_data import (
    HIGH_HZ,
    LOW_HZ,
    POSES,
    deviation,
    lines_hz,
    model_at,
    motor_frf,
    responses,
    robot,
)
from flexarm_bringup.reproduce.seed_003_golden import free_hz, locked_hz
from flexarm_model.bodies.reduction import mode_basis
from flexarm_model.served.linear_assembly import LinearAssembly

MIDDLE_HZ = 60.0
BOUNDS = (0.3, 0.8)  # dB at 4-60 and 60-100 Hz, with seven modes
FREE_BOUND = 0.2  # %
NOTES = {7: "0.09–0.22 | 0.5–0.6", 12: "≤ 0.02 | ≤ 0.09"}  # dB below and above 60 Hz; seed 003, section 4
MODELS = {"full": "full model", "cb_500": "CB-500", "guyan": "Guyan, the robot's own reduction"}


def with_modes(model: LinearAssembly, modes: int) -> LinearAssembly:
    """Return the model in its motors and its slowest modes with the motors held, as it is served."""
    t = np.flatnonzero(model.B.any(axis=1))
    e = np.setdiff1d(np.arange(model.n), t)
    M, _, K = model.locked()
    T = np.zeros((model.n, t.size + modes))
    T[t, np.arange(t.size)] = 1.0
    T[e, : t.size] = -np.linalg.solve(K, model.K[np.ix_(e, t)])
    T[e, t.size :] = mode_basis(M, K, np.eye(e.size), modes)[0]
    names = (*(model.coordinates[i] for i in t), *(f"mode_{i + 1}" for i in range(modes)))
    return replace(
        model,
        coordinates=names,
        M=T.T @ model.M @ T,
        D=T.T @ model.D @ T,
        K=T.T @ model.K @ T,
        B=T.T @ model.B,
        gravity_force=T.T @ model.gravity_force,
        rows={name: rows @ T for name, rows in model.rows.items()},
    )


def served_table() -> tuple[Table, list[Check]]:
    """Return how far the served forms lie from the full model, at three poses."""
    rows: list[Cells] = []
    worst: dict[tuple[str, int], list[float]] = {}
    for name, title in MODELS.items():
        for modes in NOTES:
            found = [_compare(name, pose, modes) for pose in POSES]
            worst[name, modes] = np.max(found, axis=0).tolist()
            rows.append(
                [title, f"6 + {modes}", NOTES[modes] if name == "full" else None, *np.ravel(found).tolist()]
            )
    columns = [Column("served from"), Column("order"), Column("notes [dB]")]
    for pose in POSES:
        columns += [
            Column(f"{pose}\n4–60 [dB]", ".2f"),
            Column("\n60–100 [dB]", ".2f"),
            Column("\nfree modes [%]", ".3f"),
        ]
    low, high, free = worst["full", 7]
    served = robot().modes
    held = [int((locked_hz(model_at("full", pose)) < HIGH_HZ).sum()) for pose in POSES]
    checks = [
        Check("served 6 + 7 against full, 4–60 Hz", f"≤ {BOUNDS[0]} dB", f"{low:.2f} dB", low <= BOUNDS[0]),
        Check(
            "served 6 + 7 against full, 60–100 Hz", f"≤ {BOUNDS[1]} dB", f"{high:.2f} dB", high <= BOUNDS[1]
        ),
        Check("its free-motor modes below 100 Hz", f"≤ {FREE_BOUND} %", f"{free:.3f} %", free <= FREE_BOUND),
        Check("modes served: all below 100 Hz", str(held), str(served), held == [served] * len(POSES)),
    ]
    notes = [
        "Free modes: largest error of the frequencies below 100 Hz with free motors, against the full model."
    ]
    return Table("The served form against the full model", columns, rows, notes), checks


def _compare(name: str, pose: str, modes: int) -> tuple[float, float, float]:
    """Return the deviations below and above 60 Hz [dB] and the largest error of a free mode [%]."""
    form = with_modes(model_at(name, pose), modes)
    full, frf = responses("full", pose), motor_frf(form, lines_hz())
    exact = free_hz(model_at("full", pose))
    exact = exact[exact < HIGH_HZ]
    error = 100 * abs(free_hz(form)[: exact.size] / exact - 1).max()
    bands = (LOW_HZ, MIDDLE_HZ), (MIDDLE_HZ, HIGH_HZ)
    below, above = (deviation(frf, full, *band).mean for band in bands)
    return below, above, float(error)
