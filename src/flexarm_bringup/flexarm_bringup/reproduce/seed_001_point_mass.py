"""Seed 001, section 3: the exact alternative in three coordinates, a point mass on three springs.

It has the shapes of the notes' stiffness matrix and its third mode at 240 Hz. Moved to the targets of a
preset (f1, f2, and a mass that gives mode 2 the stiffness wanted at the tool) it is the null predictor: it
cannot turn, so tool and platform are one point.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.reproduce.seed_001_data import Preset
from flexarm_bringup.reproduce.seed_001_machine import GRID, SECOND, magnitude
from flexarm_model.modal.frf import Ports, modal_frf
from flexarm_model.modal.half_power import HalfPower, half_power
from flexarm_model.modal.modes import Modes, normal_modes

Array = NDArray[np.float64]

MASS = 0.72729  # kg
STIFFNESS = np.array(
    [[421262.0, 155533.0, -229481.0], [155533.0, 419041.0, -229954.0], [-229481.0, -229954.0, 1555933.0]]
)  # N/m
THIRD_HZ = 240.0


def point_mass(first_hz: float, second_hz: float, zeta: float, mass: float = MASS) -> Modes:
    """Return the modes of a point mass along x, y, z.

    Args:
        first_hz: Slowest frequency [Hz].
        second_hz: The next [Hz].
        zeta: Damping ratio of all modes [1].
        mass: [kg].
    """
    shapes = normal_modes(mass * np.eye(3), np.zeros((3, 3)), STIFFNESS).shapes
    omega = 2 * np.pi * np.array([first_hz, second_hz, THIRD_HZ])
    return Modes(omega, 2 * zeta * omega, shapes)


def null_reading(preset: Preset) -> HalfPower:
    """Return what half-power on a 1 Hz grid reads at mode 2 of the point mass, force along it."""
    mass = float(preset.targets[2]) / (2 * np.pi * preset.f2_hz) ** 2
    modes = point_mass(preset.f1_hz, preset.f2_hz, preset.zeta, mass)
    along = modes.shapes[:, [SECOND]] * np.sqrt(mass)  # (3, 1), of length 1
    frf = modal_frf(GRID, modes, Ports(along, np.eye(3)))
    return half_power(frf.f_hz, magnitude(frf), preset.f2_hz, interpolate=False)
