"""A row of ``flexarm compare`` as JSON has it."""

from __future__ import annotations

import math

from flexarm_bringup.compare_laws.judged import CompareResult
from flexarm_bringup.page.report import Cell
from flexarm_bringup.residual import decibels


def plain_row(result: CompareResult, base: float) -> dict[str, Cell]:
    """Return the figures of a run, in SI; ``base`` is what decibels refer to [m/s^2]."""
    return {
        "preset": result.preset, "law": result.law, "motion": result.motion,
        "scarce_torque": result.is_scarce,
        "frequency_error": result.frequency_error, "residual_m_s2": finite(result.residual),
        "db": finite(decibels(result.residual, base)) if result.has_ended else None,
        "settling_s": finite(result.settling), "moving_s": finite(result.moving),
        "rest_error_m": finite(result.rest_error), "peak_torque": finite(result.peak_torque),
        "peak_strain": finite(result.peak_strain), "stopped": result.stopped,
    }  # fmt: skip


def finite(value: float | None) -> float | None:
    """Return a value that JSON can hold; None where there is none."""
    return value if value is not None and math.isfinite(value) else None
