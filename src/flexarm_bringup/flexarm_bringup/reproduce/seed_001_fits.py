"""Seed 001, better than half-power: two modes of the machine from noisy responses, again and again.

Noise is white and complex, so many dB below the largest response; the excitation is free of it. The modal
fit is told how many modes there are and starts within 4 Hz of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_bringup.reproduce.seed_001_machine import FIRST, SECOND, Machine, magnitude
from flexarm_model.modal.fit import fit_poles
from flexarm_model.modal.frf import Frf
from flexarm_model.modal.half_power import LinesTooCoarseError, half_power
from flexarm_model.modal.modes import poles_of

Array = NDArray[np.float64]

SEED_OF_NOISE = 1
NOISE_DB = 40.0
BAND = np.arange(75.0, 151.0)  # Hz: 20 Hz around both modes, 1 Hz lines
ANGLES_DEG = (0.0, 10.0, 25.0, 40.0)
START_HZ, START_ZETA = 4.0, 0.02
BOUNDS = {"f": 0.03, "ζ": 1.0, "k": 1.0}  # % rms up to 25 degrees, seed 001, section 6
BOUNDED_DEG = 25.0
SEED_SAYS = {  # rms [%]: f and zeta of 96 / 129 Hz at 10 degrees, k at every angle
    "modal fit": ("f .010/.010, ζ .5/.4", (0.22, 0.24, 0.70, 1.2)),
    "half-power": ("f .06/.08, ζ 3.5/1.4", (1.3, 1.2, 2.2, 5.9)),
    "half-power on lines": ("ζ 10.2/.2", (None, None, None, None)),
}
COLUMNS = (
    Column("force off\n[°]", "g"),
    Column("estimator"),
    Column("rms f [%]\n96 Hz", ".3f"),
    Column("\n129 Hz", ".3f"),
    Column("rms ζ [%]\n96 Hz", ".2f"),
    Column("\n129 Hz", ".2f"),
    Column("rms k [%]\n129 Hz", ".2f"),
    Column("\nseed 001", "g"),
    Column("f, ζ: seed 001"),
)


@dataclass(frozen=True)
class Accuracy:
    """Root mean square errors over the runs [%]: f and zeta of both modes, (2,) each, and k of mode 2."""

    f: Array
    zeta: Array
    k: float


def fit_study_table(machine: Machine, runs: int) -> tuple[Table, list[Check]]:
    """Return how well each estimator finds 96 and 129 Hz at the tool, over the direction of the force."""
    rows: list[Cells] = []
    worst = dict.fromkeys(BOUNDS, 0.0)
    for i, degrees in enumerate(ANGLES_DEG):
        found = study(machine, degrees, runs)
        for name, accuracy in found.items():
            says, stiffness = SEED_SAYS[name]
            cells = [*accuracy.f.tolist(), *accuracy.zeta.tolist(), accuracy.k]
            shown = [value if np.isfinite(value) else None for value in cells]
            rows.append([degrees, name, *shown, stiffness[i], says if degrees == ANGLES_DEG[1] else ""])
        if degrees <= BOUNDED_DEG:
            fit = found["modal fit"]
            for key, values in (("f", fit.f), ("ζ", fit.zeta), ("k", fit.k)):
                asked = np.atleast_1d(values)[0 if degrees else -1 :]  # at 0 degrees only the second mode is
                worst[key] = float(np.maximum(worst[key], asked.max()))  # keeps what is no number
    checks = [
        Check(
            f"modal fit at {NOISE_DB:g} dB, 1 Hz lines, force up to {BOUNDED_DEG:g}° off: rms of {key}",
            f"≤ {bound:g} %",
            f"{worst[key]:.3f} %",
            worst[key] <= bound,
        )
        for key, bound in BOUNDS.items()
    ]
    notes = [
        f"{runs} runs, {NOISE_DB:g} dB, outputs x, y, z at the tool, sim preset; half-power is the null.",
        "At 0° mode 1 does not answer: one mode is fitted, half-power reads one.",
        "Half-power on lines: f is luck, 96 and 129 Hz lie on lines. Its k knows the angle of the force.",
        "Circle fit is not part of this package, LSCF is one of 'flexarm identify'. White noise, one seed.",
    ]
    return Table("Better than half-power: 96 and 129 Hz at 40 dB", COLUMNS, rows, notes), checks


def study(machine: Machine, degrees: float, runs: int) -> dict[str, Accuracy]:
    """Return the accuracy of every estimator for a force that is so many degrees off mode 2."""
    rng = np.random.default_rng(SEED_OF_NOISE)
    force = machine.force("tool", degrees)
    clean = machine.drive_point("tool", force, BAND)
    modes = (FIRST, SECOND) if degrees else (SECOND,)
    truth = machine.f_hz[list(modes)]
    found: dict[str, list[Array]] = {name: [] for name in SEED_SAYS}
    for _ in range(runs):
        frf = with_noise(clean, NOISE_DB, rng)
        fit = fit_poles(frf, start_poles(truth, rng)).model
        found["modal fit"].append(_row(fit.f_hz, fit.zeta, float(fit.modal_stiffness(force)[-1])))
        for name, between in (("half-power", True), ("half-power on lines", False)):
            f, zeta, k = np.transpose([_half_power(frf, near, between) for near in truth])
            found[name].append(_row(f, zeta, k[-1] * np.cos(np.radians(degrees))))
    wanted = _row(truth, machine.model.zeta[list(modes)], machine.stiffness("tool"))
    errors = {name: rms_percent(rows, wanted) for name, rows in found.items()}
    return {name: Accuracy(row[:2], row[2:4], float(row[4])) for name, row in errors.items()}


def start_poles(truth: Array, rng: np.random.Generator) -> NDArray[np.complex128]:
    """Return where the fit starts: within 4 Hz of the truth, with one guess of the damping."""
    off = rng.uniform(-START_HZ, START_HZ, truth.size)
    return poles_of(truth + off, np.full(truth.size, START_ZETA))


def with_noise(frf: Frf, level_db: float, rng: np.random.Generator) -> Frf:
    """Return responses with white complex noise, ``level_db`` below the largest magnitude."""
    noise = (rng.standard_normal(frf.H.shape) + 1j * rng.standard_normal(frf.H.shape)) / np.sqrt(2)
    return Frf(frf.f_hz, frf.H + abs(frf.H).max() * 10 ** (-level_db / 20) * noise, frf.kind)


def rms_percent(found: Sequence[Array], truth: Array) -> Array:
    """Return the root mean square relative error over the runs [%], (m,); nan where nothing was found."""
    return np.asarray(100 * np.sqrt(np.mean((np.array(found) / truth - 1) ** 2, axis=0)))


def _half_power(frf: Frf, near_hz: float, interpolate: bool) -> tuple[float, float, float]:
    """Return f [Hz], zeta [1] and k [N/m]; nan where the lines are too coarse for them."""
    try:
        found = half_power(frf.f_hz, magnitude(frf), near_hz, interpolate)
    except LinesTooCoarseError:
        return (np.nan,) * 3
    return found.f_hz, found.zeta, found.stiffness


def _row(f: Array, zeta: Array, k: float) -> Array:
    """Return f and zeta of both modes and k, (5,); nan for a mode that was not asked for."""
    missing = np.full(2 - f.size, np.nan)
    return np.concatenate([missing, f, missing, zeta, [k]])
