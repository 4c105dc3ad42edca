"""Seed 002, section 6: what timing and shaping alone do, with a hub that moves exactly as commanded.

What is left after the motion is one measure; the paper's own is the RMS of the whole record, with the move in
it, of which shaping can take no more than the ringing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Table
from flexarm_bringup.reproduce.damping_check import damping_check
from flexarm_bringup.reproduce.seed_002_data import CALIBRATIONS, SIMULATION, ModalData, record
from flexarm_bringup.reproduce.vibration import Damping, constant, simulate
from flexarm_bringup.residual import decibels, residual_rms, settling_time
from flexarm_model.motion.profiles import Profile, Trapezoid
from flexarm_model.motion.shapers import shape_within, zv, zvd

ZETA = 0.015  # assumed, constant, of the control studies in the notes
RATE_HZ = 2048.0
RECORD = 6.0  # s; the worst case settles at 4.3 s
ANGLE = math.radians(10.0)
FREQUENCY_ERRORS = (-0.10, -0.05, 0.0, 0.05, 0.10)  # of the real arm against the one designed for
BASE = "C1A, the base"
NOTED = {  # seed 002, section 6: residual RMS [m/s^2] at exact frequency, recomputed by the notes
    BASE: 1.940,
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
BASE_BOUND = 0.001  # relative: four digits are printed; ζ of 0.0151 makes 0.003
SLACK_DB = 1.0  # of bounds printed without decimals
NOTED_GAINS = {  # seed 002, section 7: at most so many times less RMS of the whole record
    "ZV on C1A, same second": 7.6,
    "ZVD on C1A, same second": 9.8,
}


@dataclass(frozen=True)
class Result:
    """Residual RMS [m/s^2] and settling time [s] of one motion on one arm."""

    residual: float
    settling: float


Results = dict[str, dict[float, Result]]  # motion -> frequency error -> result


def motions(modes: ModalData) -> dict[str, Profile]:
    """Return the motions, designed for the nominal frequency; all take one second."""
    mode, zeta = modes.first, float(modes.zeta[0])
    period = 2.0 * math.pi / mode.omega
    base, b, d = (Trapezoid.published(case, ANGLE, period) for case in "ABD")
    profiles = (
        base,
        b,
        d,
        Trapezoid(ANGLE, 1.0, period, period),
        shape_within(base, zv(mode.omega, zeta)),
        shape_within(base, zvd(mode.omega, zeta)),
    )
    return dict(zip(NOTED, profiles, strict=True))


def measure(profile: Profile, modes: ModalData, frequency_error: float) -> Result:
    """Return what is left on an arm whose frequency is off by that share."""
    mode = replace(modes.first, omega=modes.first.omega * (1.0 + frequency_error))
    vibration = simulate(profile, mode, constant(float(modes.zeta[0])), RATE_HZ, int(RECORD * RATE_HZ))
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


def whole_record_gains(modes: ModalData, damping: Damping, window: float) -> dict[str, float]:
    """Return by motion how many times less RMS than case A the whole record has, as the paper takes it.

    Args:
        modes: Of the arm.
        damping: Its damping ratio.
        window: RMS from t = 0 to here [s].
    """
    level = {name: record(p, modes.first, damping, window).rms for name, p in motions(modes).items()}
    return {name: level[BASE] / rms for name, rms in level.items()}


def shaping_table(results: Results, modes: ModalData) -> tuple[Table, list[Check]]:
    """Return what each motion leaves of case A after it and in all, and whether the notes' bounds hold."""
    zeta = float(modes.zeta[0])
    gains = whole_record_gains(modes, constant(zeta), SIMULATION.window)
    columns = [
        Column("motion, 10° in 1 s"),
        Column("residual\n[m/s²]", ".4f"),
        Column("notes\n[m/s²]", ".4f"),
        Column("settling\n[ms]", ".0f"),
        *(
            Column(f"[dB] at\nf {100 * error:+.0f} %" if error else "[dB]\nexact f", ".1f")
            for error in FREQUENCY_ERRORS
        ),
        Column("whole record\ntimes less", ".1f"),
        Column("notes\nat most", ".1f"),
    ]
    rows: list[Cells] = []
    for name, at in results.items():
        exact = at[0.0]
        head: Cells = [name, exact.residual, NOTED[name], 1000.0 * exact.settling]
        rows.append([*head, *_levels(results, name).values(), gains[name], NOTED_GAINS.get(name)])
    notes = [
        "Notes: recomputed by the notes on this paper; the paper has neither residuals nor shapers.",
        f"An ideal servo and ζ = {zeta:g} are assumed: no dB here is that of the real rig. "
        "0 dB: C1A at exact f.",
        "Residual: 20 Hz, in [1.1, 3.1] s. Settling: tip within 0.5 mm, counted from the end of the motion.",
        f"Whole record: RMS from t = 0 to {SIMULATION.window:g} s, the move in it, as the paper takes it. "
        "There shaping gains little beside the decibels: what is left is the move.",
        _other_gains(modes),
        "C1A settles in 4.2 s, not in the 3.9 s of the notes: that is what its residual and ζ imply.",
        "Ours are exact in time and leave less at exact f than the notes'; why they leave more is open.",
    ]
    table = Table("Vibration left by timing and by shaping alone", columns, rows, notes)
    damping, base = damping_check("mode 1", np.array([zeta]), ZETA), results[BASE][0.0].residual
    return table, [damping, _base_check(base), *_level_checks(results), _gain_check(gains, zeta)]


def _levels(results: Results, name: str) -> dict[float, float]:
    """Return the residuals of a motion against case A at exact frequency [dB], by frequency error."""
    base = results[BASE][0.0].residual
    return {error: decibels(result.residual, base) for error, result in results[name].items()}


def _other_gains(modes: ModalData) -> str:
    """Return what the gains in the whole record are with the damping and windows fitted to table 2."""
    told = []
    for fit in CALIBRATIONS.values():
        gains = whole_record_gains(modes, fit.damping, fit.window)
        told.append(f"{' / '.join(f'{gains[name]:.1f}' for name in NOTED_GAINS)} of the {fit.name}")
    return (
        f"The arm's damping is not established: with damping and window as fitted to table 2 ZV / ZVD have "
        f"{', '.join(told)}. No more than the notes' is claimed."
    )


def _level_checks(results: Results) -> list[Check]:
    checks: list[Check] = []
    for name, bounds in BOUNDS_DB.items():
        level = _levels(results, name)
        pairs = zip(bounds, (0.0, 0.05, 0.10), strict=True)
        worst = [(max(level[e], level[-e]), bound) for bound, e in pairs]
        text = " / ".join(f"{bound:g}" for _, bound in worst)
        found = " / ".join(f"{value:.1f}" for value, _ in worst)
        met = all(value <= bound + SLACK_DB for value, bound in worst)
        checks.append(Check(f"{name}: exact / ±5 / ±10 %", f"≤ {text} dB (+{SLACK_DB:g})", found, met))
    return checks


def _gain_check(gains: dict[str, float], zeta: float) -> Check:
    """Return whether shaping gains no more in the whole record than the notes let anyone claim."""
    wanted = " / ".join(f"{bound:g}" for bound in NOTED_GAINS.values())
    found = " / ".join(f"{gains[name]:.1f}" for name in NOTED_GAINS)
    met = all(gains[name] <= bound for name, bound in NOTED_GAINS.items())
    return Check(f"whole-record RMS, ζ = {zeta:g}: ZV / ZVD gain", f"≤ {wanted} times", f"{found} times", met)


def _base_check(residual: float) -> Check:
    """Return whether case A alone leaves what the notes say, which its damping decides."""
    met = abs(residual / NOTED[BASE] - 1.0) <= BASE_BOUND
    wanted = f"{NOTED[BASE]:.3f} m/s² ± {100.0 * BASE_BOUND:g} %"
    return Check(f"{BASE}: residual at exact f", wanted, f"{residual:.3f} m/s²", met)
