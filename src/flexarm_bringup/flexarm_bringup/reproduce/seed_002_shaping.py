"""Seed 002, section 6: what timing and shaping alone do, with a hub that moves exactly as commanded."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_bringup.reproduce.seed_002_data import ModalData
from flexarm_bringup.reproduce.vibration import constant, simulate
from flexarm_bringup.residual import decibels, residual_rms, settling_time
from flexarm_model.motion.profiles import Profile, Trapezoid
from flexarm_model.motion.shapers import shape_within, zv, zvd

ZETA = 0.015  # assumed, constant, of the control studies
RATE_HZ = 2048.0
RECORD = 6.0  # s; the worst case settles at 4.3 s
ANGLE = math.radians(10.0)
FREQUENCY_ERRORS = (-0.10, -0.05, 0.0, 0.05, 0.10)  # of the real arm against the one designed for
PUBLISHED = {  # seed 002, section 6: residual RMS [m/s^2] at exact frequency
    "C1A, the base": 1.940,
    "C1B": 0.111,
    "C1D": 0.164,
    "t_a = t_d = T": 0.035,
    "ZV on C1A, same second": 0.0043,
    "ZVD on C1A, same second": 0.0007,
}
BOUNDS_DB = {
    "ZV on C1A, same second": (-53.0, -20.0, -14.0),
    "ZVD on C1A, same second": (-69.0, -42.0, -29.0),
}
SLACK_DB = 1.0  # of bounds printed without decimals


@dataclass(frozen=True)
class Result:
    """Residual RMS [m/s^2] and settling time [s] of one motion on one arm."""

    residual: float
    settling: float


Results = dict[str, dict[float, Result]]  # motion -> frequency error -> result


def motions(modes: ModalData) -> dict[str, Profile]:
    """Return the motions, designed for the nominal frequency; all take one second."""
    mode = modes.first
    period = 2.0 * math.pi / mode.omega
    base, b, d = (Trapezoid.published(case, ANGLE, period) for case in "ABD")
    profiles = (
        base,
        b,
        d,
        Trapezoid(ANGLE, 1.0, period, period),
        shape_within(base, zv(mode.omega, ZETA)),
        shape_within(base, zvd(mode.omega, ZETA)),
    )
    return dict(zip(PUBLISHED, profiles, strict=True))


def measure(profile: Profile, modes: ModalData, frequency_error: float) -> Result:
    """Return what is left on an arm whose frequency is off by that share."""
    mode = replace(modes.first, omega=modes.first.omega * (1.0 + frequency_error))
    vibration = simulate(profile, mode, constant(ZETA), RATE_HZ, int(RECORD * RATE_HZ))
    angle = profile.sample(vibration.t)[0]
    error = modes.tip_radius * (angle - ANGLE) + modes.tip_share * vibration.deflection
    residual = residual_rms(vibration.t, vibration.acceleration, profile.duration)
    return Result(residual, settling_time(vibration.t, error, profile.duration))


def measure_all(modes: ModalData) -> Results:
    """Return every motion at every frequency error."""
    profiles = motions(modes)
    return {
        name: {error: measure(profile, modes, error) for error in FREQUENCY_ERRORS}
        for name, profile in profiles.items()
    }


def shaping_table(results: Results) -> tuple[Table, list[Check]]:
    """Return the residuals in dB against case A on the same arm, and whether the seed's hold."""
    base = results[next(iter(results))]
    columns = [
        Column("motion, 10° in 1 s"),
        Column("residual\n[m/s²]", ".4f"),
        Column("seed 002", ".4f"),
        Column("settling\n[ms]", ".0f"),
        *(
            Column(f"[dB] at\nf {100 * error:+.0f} %" if error else "[dB]\nexact f", ".1f")
            for error in FREQUENCY_ERRORS
        ),
    ]
    rows: list[Cells] = []
    checks: list[Check] = []
    for name, at in results.items():
        level = {error: decibels(result.residual, base[0.0].residual) for error, result in at.items()}
        rows.append([name, at[0.0].residual, PUBLISHED[name], 1000.0 * at[0.0].settling, *level.values()])
        if name in BOUNDS_DB:
            pairs = zip(BOUNDS_DB[name], (0.0, 0.05, 0.10), strict=True)
            worst = [(max(level[e], level[-e]), bound) for bound, e in pairs]
            text = " / ".join(f"{bound:g}" for _, bound in worst)
            found = " / ".join(f"{value:.1f}" for value, _ in worst)
            met = all(value <= bound + SLACK_DB for value, bound in worst)
            checks.append(Check(f"{name}: exact / ±5 / ±10 %", f"≤ {text} dB (+{SLACK_DB:g})", found, met))
    notes = [
        "An ideal servo and ζ = 0.015 are assumed: no dB here is that of the real rig. 0 dB: C1A at exact f.",
        "Residual: 20 Hz, in [1.1, 3.1] s. Settling: tip within 0.5 mm, counted from the end of the motion.",
        "C1A settles in 4.2 s, not in the 3.9 s of seed 002: that is what its residual and ζ imply.",
        "Ours are exact in time and leave less at exact f than seed 002; why it has more is not established.",
        "Closed loop (LQR, MPC) on the simulated rig, with ±10 % frequency: flexarm demo.",
    ]
    return Table("Vibration left by timing and by shaping alone", columns, rows, notes), checks
