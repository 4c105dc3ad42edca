"""MPC against the best shaper where frequencies are off: once for each sign, once for the worse of both.

For one sign the rival is the shaper that happens to leave least there; for both it is the one that is best
at the worse of them, for nobody knows the sign when a shaper is chosen. Shapers are followed by two: joint PD
has the motors, sensors, delay and limits that MPC has, so it is what MPC is judged by; the ideal servo has no
limit, no sensor and no noise, so nothing that closes a loop on a sensor can be held to it. Both are told.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from flexarm_bringup.compare_laws.judged import CompareResult
from flexarm_bringup.compare_laws.open_loop_motions import SHAPERS
from flexarm_bringup.compare_laws.schemes import LAW_NAMES, MPC, PD, SERVO
from flexarm_bringup.residual import decibels

ROBUST_ERRORS = (-0.10, 0.10)
REALISABLE = PD


@dataclass(frozen=True)
class Rivalry:
    """The better MPC row and the best shaper at some frequency errors.

    Attributes:
        law: Who follows the shapers.
        errors: Real over described frequencies, minus 1; the worst of them counts.
        mpc: What the better MPC row leaves [m/s^2].
        shaper: Name of the best shaper.
        left: What it leaves [m/s^2].
    """

    law: str
    errors: tuple[float, ...]
    mpc: float
    shaper: str
    left: float

    @property
    def gap(self) -> float:
        """What MPC leaves over what the shaper does [dB]; negative where MPC leaves less."""
        return decibels(self.mpc, self.left)

    @property
    def name(self) -> str:
        """What is compared."""
        return name_of(self.law, self.errors)

    @property
    def text(self) -> str:
        """How it came out."""
        return f"{self.gap:+.1f} dB ({self.shaper}: {self.left:.4f} m/s²)"


def name_of(law: str, errors: Sequence[float]) -> str:
    """Return what MPC is compared with at some frequency errors, for people."""
    signs = " and ".join(f"{100 * error:+.0f}" for error in errors)
    return f"f {signs} %: better MPC row over the best shaper, {LAW_NAMES[law]}"


def is_shaped(motion: str) -> bool:
    """Tell whether a motion of that name is a shaped one."""
    return motion.split(",")[0] in SHAPERS


def rivalries(rows: Sequence[CompareResult]) -> list[Rivalry]:
    """Return all that the rows allow to compare, those that MPC is judged by first."""
    found = []
    for law in (REALISABLE, SERVO):
        for errors in (*((error,) for error in ROBUST_ERRORS), ROBUST_ERRORS):
            mpc = _worst_of(rows, MPC, errors)
            shapers = {m: left for m, left in _worst_of(rows, law, errors).items() if is_shaped(m)}
            if mpc and shapers:
                best = min(shapers, key=lambda motion: shapers[motion])
                found.append(Rivalry(law, errors, min(mpc.values()), best, shapers[best]))
    return found


def _worst_of(rows: Sequence[CompareResult], law: str, errors: Sequence[float]) -> dict[str, float]:
    """Return the worst residual at these errors by motion, where there is one at each [m/s^2]."""
    found: dict[str, list[float]] = {}
    for row in rows:
        if row.law == law and row.has_ended and row.frequency_error in errors:
            found.setdefault(row.motion, []).append(row.residual)
    return {motion: max(left) for motion, left in found.items() if len(left) == len(errors)}
