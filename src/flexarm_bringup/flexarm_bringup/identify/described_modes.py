"""The modes of a description beside those of a measurement, and which of them no measurement can tell.

A pole with more than ``LARGEST_DAMPING`` of critical damping is taken for a slope of the responses, not for a
resonance: an arm whose drives or springs damp so much is measured in vain.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_model.identification.automatic import LARGEST_DAMPING
from flexarm_model.identification.described_arm import DescribedArm
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

Array = NDArray[np.float64]
PERCENT = 100.0


def described_modes(
    manipulator: str, preset: str, pose: tuple[float, ...], motors_locked: bool
) -> tuple[Array, Array]:
    """Return frequencies [Hz] and damping ratios [1] of a description, slowest first, (r,) each.

    Args:
        manipulator: Name or file; none are returned where it is empty.
        preset: Its preset.
        pose: Actuated axes [rad or m]; empty for home.
        motors_locked: With the actuated axes held instead of free.

    Raises:
        ConfigError: There is no such description.
        PoseError, ClosureError: There is no model at the pose.
    """
    if not manipulator:
        return np.zeros(0), np.zeros(0)
    path = find_manipulator(manipulator)
    at = np.array(pose) if pose else load_config(path, preset).home
    modes = DescribedArm(path, preset, motors_locked).modes({}, at)
    return modes.omega / (2 * np.pi), modes.zeta


def no_resonance(f_hz: Array, zeta: Array, band_hz: tuple[float, float], motors_locked: bool) -> str:
    """Return why no mode of a description can be found in a band; empty where one can.

    Args:
        f_hz: Frequencies of the description [Hz], (r,).
        zeta: Damping ratios [1], (r,).
        band_hz: Band [Hz].
        motors_locked: Of motors that are held instead of free.
    """
    inside = (f_hz >= band_hz[0]) & (f_hz <= band_hz[1])
    if (zeta[inside] <= LARGEST_DAMPING).any():
        return ""
    motors = "held" if motors_locked else "free"
    told = ", ".join(
        f"{f:.4g} Hz with {PERCENT * z:.0f} %" for f, z in zip(f_hz[inside], zeta[inside], strict=True)
    )
    return (
        f"with {motors} motors the description has no mode in this band with "
        f"{PERCENT * LARGEST_DAMPING:.0f} % of critical damping or less ({told or 'none oscillates'}), and "
        "more is taken for a slope: no modal test finds it; --joints identifies the drives"
    )
