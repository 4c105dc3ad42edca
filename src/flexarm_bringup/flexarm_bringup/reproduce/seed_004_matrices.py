"""Seed 004: mass matrix and gravity at rigid links, modes under both units of stiffness, inverse kinematics.

Rigid links are the product's reduced tree with its servos and their springs' coordinates at an angle and at
zero; the rows of the springs are those of the links.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_bringup.reproduce.seed_004_data import arm_config, elbow_arm
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]

RELATIVE = 1e-4  # golden values, beyond the last printed digit
QUANTITIES = ("M11", "M22", "M23", "M33", "G2", "G3", "x [mm]", "y [mm]", "z [mm]")
HALF_DIGITS = np.repeat([5e-6, 5e-5, 5e-4], [4, 2, 3])  # of M [kg m^2], G [N m], tip [mm]
GOLDEN = {  # seed 004, section 4
    (0.0, 16.0, 0.0): (0.03284, 0.03302, 0.00838, 0.00303, 0.8956, 0.1739, 509.469, 0.0, 186.088),
    (0.0, 16.0, -45.0): (0.03147, 0.02989, 0.00681, 0.00303, 0.8800, 0.1582, 488.675, 0.0, 3.581),
    (30.0, 60.0, -45.0): (0.01516, 0.02989, 0.00681, 0.00303, 0.5501, 0.1747, 326.338, 188.411, 353.264),
}
RANDOM_POSES, SEED = 200, 4
LOWEST_DEG, HIGHEST_DEG = (-180.0, -60.0, 3.0), (180.0, 240.0, 150.0)  # a straight elbow is singular
INVERSE_BOUND = 1e-9  # deg
SYMMETRY = 1e-14  # of the largest element
MODE_POSE_DEG = (0.0, 16.0, -45.0)
GOLDEN_MODES = {  # unit: modes [Hz] and damping ratios of joints 1 to 3; seed 004, section 3
    "deg": ((8.74, 8.75, 41.5), (0.38, 0.39, 1.21)),
    "rad": ((1.16, 1.16, 5.5), (2.8, 2.9, 9.2)),
}
MODE_DIGITS = {  # half of the last digit printed there
    "deg": ((0.005, 0.005, 0.05), (0.005, 0.005, 0.005)),
    "rad": ((0.005, 0.005, 0.05), (0.05, 0.05, 0.05)),
}
MODE_CASES = {"deg": "", "deg, soft": "soft", "rad": "rad"}
GOLDEN_COLUMNS = (
    Column("q [deg]"),
    Column("quantity"),
    Column("golden", "g"),
    Column("ours", ".6g"),
    Column("error", "+.1e"),
)
MODE_COLUMNS = (
    Column("stiffness_unit"),
    Column("pressure\n[bar]", ".0f"),
    Column("k\n[N m/rad]", ".3g"),
    Column("modes of the\nlinks [Hz]"),
    Column("damping ratio\nof joints 1, 2, 3"),
    Column("sag of joint 2 at\nq2 = 16° [deg]", ".2f"),
    Column("can oscillate"),
)


@dataclass(frozen=True)
class RigidLinks:
    """The arm without motion in its springs."""

    config: ManipulatorConfig

    @cached_property
    def tree(self) -> ReducedTree:
        """The dynamics of servos and links."""
        return ReducedTree(self.config, use_compiler=False)

    @property
    def links(self) -> list[int]:
        """Coordinates of the springs."""
        return [i for i in range(self.tree.n_q) if i not in self.tree.actuated]

    def coordinates(self, q: Array) -> Array:
        """Return the tree's coordinates at joint angles [rad], (3,)."""
        full = np.zeros(self.tree.n_q)
        full[self.tree.actuated] = q
        return full

    def mass_matrix(self, q: Array) -> Array:
        """Return M [kg m^2], (3, 3)."""
        M = np.array(self.tree.functions["mass_matrix"](self.coordinates(q)))
        return M[np.ix_(self.links, self.links)]

    def gravity(self, q: Array) -> Array:
        """Return G [N m], (3,)."""
        rest = np.zeros(self.tree.n_q)
        return np.array(self.tree.functions["bias"](self.coordinates(q), rest))[self.links]

    def tip(self, q: Array) -> Array:
        """Return the tip [m], (3,)."""
        return self.tree.tip_pose(self.coordinates(q))[:3, 3]

    def quantities(self, q: Array) -> Array:
        """Return what ``QUANTITIES`` names, (9,)."""
        M, G = self.mass_matrix(q), self.gravity(q)
        return np.array([M[0, 0], M[1, 1], M[1, 2], M[2, 2], G[1], G[2], *(1e3 * self.tip(q))])

    @property
    def springs(self) -> tuple[Array, Array]:
        """Stiffness [N m/rad] and damping [N m s/rad], (3,) each."""
        axes = [self.tree.axes[i] for i in self.links]
        return np.array([axis.stiffness for axis in axes]), np.array([axis.damping for axis in axes])

    def modes(self) -> tuple[Array, Array]:
        """Return frequencies of the links [Hz] and damping ratios of the joints [1], (3,) each; no weight."""
        k, c = self.springs
        M = self.mass_matrix(np.radians(MODE_POSE_DEG))
        f_hz = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, np.diag(k))).real)) / (2 * np.pi)
        return f_hz, c / (2.0 * np.sqrt(k * np.diag(M)))


def golden_table(arm: RigidLinks) -> tuple[Table, list[Check]]:
    """Return the golden values of M, G and the tip, and what is found on random poses."""
    rows: list[Cells] = []
    good = True
    for pose, golden in GOLDEN.items():
        ours = arm.quantities(np.radians(pose))
        off = ours - np.array(golden)
        good = good and bool((np.abs(off) <= HALF_DIGITS + RELATIVE * np.abs(golden)).all())
        where = "({:g}, {:g}, {:g})".format(*pose)
        for i, name in enumerate(QUANTITIES):
            rows.append([where, name, golden[i], float(ours[i]), float(off[i])])
    notes = ["M in kg m², G in N m, at rigid links; error beside the last digit that the note gives."]
    checks = [
        Check(
            "golden M, G and tip", "1e-4 and half the last printed digit", "all" if good else "not all", good
        ),
        *_random_checks(arm),
    ]
    return Table("Mass matrix, gravity and tip at rigid links", GOLDEN_COLUMNS, rows, notes), checks


def mode_table() -> Table:
    """Return modes, damping and sag under both readings of the unit, and at the assumed softer pressure."""
    rows: list[Cells] = []
    for unit, preset in MODE_CASES.items():
        arm = RigidLinks(arm_config(preset))
        f_hz, zeta = arm.modes()
        q0 = linearize(arm.tree, np.radians([0.0, 16.0, 0.0])).q0
        sag = -float(np.degrees(q0[arm.links[1]]))
        texts = [" / ".join(f"{value:.3g}" for value in values) for values in (f_hz, zeta)]
        bar = arm.config.parameters["pressure"] / 1e5
        rows.append([unit, bar, float(arm.springs[0][0]), *texts, sag, bool(zeta.min() < 1.0)])
    notes = [
        "Links at (0, 16, −45)°, servos held, without gravity; damping ratio of a joint: c / (2 √(k M_jj)).",
        "The paper reports oscillations, which N m/rad cannot give. Table 4 does not decide between them.",
        "1 bar: proportional law, assumed for demonstration; only 2 bar was tested.",
    ]
    return Table("Unit of the stiffness: modes, damping and sag", MODE_COLUMNS, rows, notes)


def mode_checks() -> list[Check]:
    """Return whether modes and damping ratios are those of the notes, under both readings of the unit."""
    checks = []
    for unit, golden in GOLDEN_MODES.items():
        found = RigidLinks(arm_config(MODE_CASES[unit])).modes()
        off = abs(np.array(found) - golden)
        wanted, ours = (
            "; ".join(" / ".join(f"{x:{form}}" for x in values) for values in both)
            for form, both in (("g", golden), (".3g", found))
        )
        good = bool((off <= MODE_DIGITS[unit]).all())
        checks.append(
            Check(f"N m/{unit}: modes [Hz]; damping ratios, half a printed digit", wanted, ours, good)
        )
    return checks


def inverse_check() -> Check:
    """Return whether the closed form finds random angles again on both elbow branches."""
    arm, rng = elbow_arm(arm_config()), np.random.default_rng(SEED)
    worst = 0.0
    for elbow in (1, -1):
        angles = rng.uniform(LOWEST_DEG, HIGHEST_DEG, (RANDOM_POSES, 3)) * np.array([1.0, 1.0, elbow])
        for q in np.radians(angles):
            reach = arm.upper * np.cos(q[1]) + arm.fore * np.cos(q[1] + q[2])
            found = arm.solve(arm.position(q), elbow, 1 if reach > 0 else -1)
            turns = np.degrees(found - q)
            worst = max(worst, float(np.abs((turns + 180.0) % 360.0 - 180.0).max()))
    name = f"inverse kinematics of {2 * RANDOM_POSES} random poses, both elbow branches"
    return Check(name, f"≤ {INVERSE_BOUND:g}°", f"{worst:.1e}°", worst <= INVERSE_BOUND)


def _random_checks(arm: RigidLinks) -> list[Check]:
    rng = np.random.default_rng(SEED)
    matrices = [arm.mass_matrix(q) for q in rng.uniform(-np.pi, np.pi, (RANDOM_POSES, 3))]
    skew = max(float(np.abs(M - M.T).max() / np.abs(M).max()) for M in matrices)
    least = min(float(np.linalg.eigvalsh(M)[0]) for M in matrices)
    name = f"M on {RANDOM_POSES} random poses"
    return [
        Check(f"{name}: symmetric", f"≤ {SYMMETRY:g}", f"{skew:.1e}", skew <= SYMMETRY),
        Check(f"{name}: positive definite", "> 0", f"least eigenvalue {least:.2e} kg m²", least > 0.0),
    ]
