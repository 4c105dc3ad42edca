"""Seed 003: is it the robot of the notes? Kinematics, rigid limit, order of the models, golden values."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_bringup.reproduce.seed_003_data import (
    DESCRIPTIONS,
    HIGH_HZ,
    POSES,
    Linear,
    model_at,
    models,
    motor_frf,
    pose_of,
    robot,
)
from flexarm_model.kinematics.dh import DhChain, DhRow
from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.served.linear_assembly import LinearAssembly, assemble

Array = NDArray[np.float64]

RIGHT = np.pi / 2
DH = DhChain(  # seed 003, section 2
    (
        DhRow(0.50, 0.18, -RIGHT),
        DhRow(0.0, 0.80, 0.0, -RIGHT),
        DhRow(0.0, 0.15, -RIGHT),
        DhRow(0.85, 0.0, RIGHT),
        DhRow(0.0, 0.0, -RIGHT),
        DhRow(0.14, 0.0, 0.0),
    )
)
LOCKED = {  # Hz; seed 003, section 4, as all below
    "home": (10.79, 12.01, 24.92, 32.03, 54.26, 55.40, 89.18, 109.68, 131.94, 158.34),
    "mid": (11.58, 11.77, 23.15, 28.60, 50.91, 54.96, 87.44, 121.09, 144.73, 155.59),
    "stretched": (9.60, 10.06, 25.43, 30.35, 61.71, 65.04, 97.35, 134.79, 142.26, 168.04),
}
FREE = {
    "home": (23.75, 31.92, 32.68, 38.42, 67.43, 71.75, 96.84),
    "mid": (26.50, 32.35, 34.04, 37.07, 63.97, 70.59, 97.04),
    "stretched": (25.19, 31.83, 38.67, 39.97, 75.18, 81.09, 98.87),
}
RESPONSES = {  # (rad/s^2)/(N m) at mid, at 10, 30 and 100 Hz
    (1, 1): (4.492e-3, 3.150e-2, 5.565e-2),
    (2, 2): (7.121e-3, 1.133e-1, 4.657e-2),
    (3, 3): (2.506e-2, 1.862e-1, 9.312e-2),
    (1, 3): (2.127e-4, 2.179e-2, 3.069e-3),
}
RESPONSE_HZ = (10.0, 30.0, 100.0)
DOF = {"full": 354, "guyan": 84, "cb_500": 88, "cb_1000": 90, "six_axis": 42, "lumped": 24, "rigid": 12}
N_MOTORS = 6
FLANGE_IN_DISC = np.array([0.07, 0.0, 0.0])  # m
KINEMATIC_BOUND = 1e-12  # m
RIGID_BOUND = 1e-10
FREQUENCY_BOUND = 0.1  # %, beam elements


def kinematics_checks() -> list[Check]:
    """Return whether bodies and table of Denavit and Hartenberg say the same, and the masses add up."""
    rng = np.random.default_rng(3)
    poses = [pose_of(name) for name in POSES] + list(rng.uniform(-1.5, 1.5, (20, N_MOTORS)))
    gap = 0.0
    for q in poses:
        place = assemble(models()["rigid"], dict(zip(robot().actuated, q.tolist(), strict=True)))
        disc = place.places["disc"]
        flange = disc.moved(FLANGE_IN_DISC, np.eye(3)).p
        gap = max(gap, float(abs(flange - DH.pose(q)[:3, 3]).max()))
    checks = [
        Check(
            "flange: Denavit-Hartenberg against chain of bodies, 23 poses",
            f"≤ {KINEMATIC_BOUND:g} m",
            f"{gap:.1e} m",
            gap <= KINEMATIC_BOUND,
        )
    ]
    off = max(_rigid_limit_error(pose) for pose in POSES)
    name = "rigid limit: motors' mass matrix against Pinocchio's (CRBA)"
    checks.append(Check(name, f"≤ {RIGID_BOUND:g}", f"{off:.1e}", off <= RIGID_BOUND))
    return checks


def _rigid_limit_error(pose: str) -> float:
    """Return the largest difference of the rigid mass matrices over the largest entry."""
    rigid, tree = model_at("rigid", pose), SegmentTree(models()["rigid"], 1)
    q = np.zeros(tree.n_q)
    q[tree.actuated] = pose_of(pose)
    M = tree.mass_matrix(q)[np.ix_(tree.actuated, tree.actuated)]
    return float(abs(rigid.B.T @ rigid.M @ rigid.B - M).max() / abs(M).max())


def order_table() -> tuple[Table, list[Check]]:
    """Return the degrees of freedom of every model."""
    found = {name: model_at(name, "mid").n for name in DESCRIPTIONS}
    rows: list[Cells] = [[name, what, DOF[name], found[name]] for name, what in DESCRIPTIONS.items()]
    columns = (Column("model"), Column("links and joints"), Column("notes", "d"), Column("ours", "d"))
    notes = [
        "Six motors are counted. The paper prints 24 for its lumped model and 6 for the purely rigid one.",
    ]
    check = Check("degrees of freedom", "as in the notes", str(list(found.values())), found == DOF)
    return Table("Order of the models", columns, rows, notes), [check]


def frequency_table() -> tuple[Table, list[Check]]:
    """Return the frequencies with motors held and free, full model."""
    rows: list[Cells] = []
    worst = 0.0
    for kind, golden in (("held", LOCKED), ("free", FREE)):
        for i in range(len(golden["mid"])):
            cells: Cells = [f"{kind} {i + 1}"]
            for pose in POSES:
                ours = (locked_hz if kind == "held" else free_hz)(model_at("full", pose))[i]
                error = 100 * (ours / golden[pose][i] - 1)
                cells += [golden[pose][i], float(ours), float(error)]
                if golden[pose][i] < HIGH_HZ:
                    worst = max(worst, abs(float(error)))
            rows.append(cells)
    columns = [Column("motors")]
    for pose in POSES:
        columns += [
            Column(f"{pose} [Hz]\nnotes", ".2f"),
            Column("\nours", ".2f"),
            Column("\nerror [%]", "+.2f"),
        ]
    notes = ["Beams are Euler-Bernoulli, as in the notes: sections have no rotary inertia in bending."]
    check = Check(
        f"frequencies below {HIGH_HZ:g} Hz, beam elements",
        f"≤ {FREQUENCY_BOUND} %",
        f"{worst:.3f} %",
        worst <= FREQUENCY_BOUND,
    )
    return Table("Frequencies of the full model", columns, rows, notes), [check]


def response_table() -> tuple[Table, list[Check]]:
    """Return the golden responses at mid."""
    H = abs(motor_frf(model_at("full", "mid"), np.array(RESPONSE_HZ)).H)  # (3, 6, 6)
    rows: list[Cells] = []
    worst = 0.0
    for (i, j), golden in RESPONSES.items():
        ours = H[:, i - 1, j - 1]
        worst = max(worst, float(100 * abs(ours / golden - 1).max()))
        rows.append(
            [f"H{i}{j}", *(cell for pair in zip(golden, ours.tolist(), strict=True) for cell in pair)]
        )
    columns = [Column("(rad/s²)/(N·m)")]
    for f in RESPONSE_HZ:
        columns += [Column(f"{f:g} Hz\nnotes", ".3e"), Column("\nours", ".3e")]
    check = Check("responses of the full model at mid", "≤ 1 %", f"{worst:.2f} %", worst <= 1.0)
    return Table("Motor acceleration per motor torque, |H| at mid", columns, rows), [check]


def locked_hz(model: LinearAssembly) -> Array:
    """Return the frequencies with the motors held [Hz]."""
    M, _, K = model.locked()
    return np.asarray(np.sqrt(eigh(K, M, eigvals_only=True)) / (2 * np.pi))


def free_hz(model: Linear) -> Array:
    """Return the frequencies with free motors, without their six rigid modes [Hz]."""
    value = eigh(model.K, model.M, eigvals_only=True)[N_MOTORS:]
    return np.asarray(np.sqrt(value) / (2 * np.pi))
