"""Physical quantities as people write them: "3.2 mm", "208.5 GPa", "0.30 kg m^2".

A number with a dimension must name its unit, so that a millimetre is never read as a metre.
"""

from __future__ import annotations

import math

_ANGLES = {"rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "deg": math.pi / 180}
_LENGTHS = {"m": 1.0, "mm": 1e-3, "um": 1e-6}
_RATES = {f"{unit}/s": factor for unit, factor in (_ANGLES | _LENGTHS).items()}
_ACCELERATIONS = {"m/s^2": 1.0, "g": 9.80665}
_TORQUES = {"N m": 1.0, "mN m": 1e-3, "kN m": 1e3}
_FORCES = {"N": 1.0, "kN": 1e3}

UNITS: dict[str, dict[str, float]] = {
    "length": _LENGTHS,
    "area": {"m^2": 1.0, "mm^2": 1e-6},
    "second moment of area": {"m^4": 1.0, "mm^4": 1e-12},
    "mass": {"kg": 1.0, "g": 1e-3},
    "inertia": {"kg m^2": 1.0, "kg mm^2": 1e-6},
    "density": {"kg/m^3": 1.0},
    "pressure": {"Pa": 1.0, "MPa": 1e6, "GPa": 1e9},
    "angle": _ANGLES,
    "time": {"s": 1.0, "ms": 1e-3},
    "frequency": {"Hz": 1.0, "kHz": 1e3},
    "acceleration": _ACCELERATIONS,
    "strain": {"m/m": 1.0, "ustrain": 1e-6},
    "ratio": {"": 1.0, "%": 1e-2},
    "position": _ANGLES | _LENGTHS,
    "velocity": _RATES,
    "effort": _TORQUES | _FORCES,
    "effort rate": {f"{unit}/s": factor for unit, factor in (_TORQUES | _FORCES).items()},
    "axis inertia": {"kg m^2": 1.0, "kg mm^2": 1e-6, "kg": 1.0, "g": 1e-3},
    "axis stiffness": {"N m/rad": 1.0, "N/m": 1.0, "N/mm": 1e3},
    "axis damping": {"N m s/rad": 1.0, "N s/m": 1.0},
}


def parse_quantity(text: object, dimension: str) -> float:
    """Return the SI value of "number unit".

    Args:
        text: What the file holds; a bare number only where the dimension is "ratio".
        dimension: A key of ``UNITS``.

    Raises:
        ValueError: Not a number, not finite, or a unit of another dimension; says what is allowed.
    """
    number, _, unit = str(text).strip().partition(" ")
    if isinstance(text, bool) or not isinstance(text, int | float | str):
        raise ValueError(f"expected {_example(dimension)}")
    if unit not in UNITS[dimension]:
        raise ValueError(
            f"unit '{unit or 'none'}' does not fit a {dimension}; expected {_example(dimension)}"
        )
    try:
        value = float(number)
    except ValueError:
        raise ValueError(f"'{number}' is not a number; expected {_example(dimension)}") from None
    if not math.isfinite(value):
        raise ValueError("must be finite")
    return value * UNITS[dimension][unit]


def _example(dimension: str) -> str:
    units = [unit or "no unit" for unit in UNITS[dimension]]
    return f"a number with one of the units: {', '.join(units)}"
