"""Physical quantities as people write them: "3.2 mm", "208.5 GPa", "0.30 kg m^2".

A number with a dimension must name its unit, so that a millimetre is never read as a metre.
"""

from __future__ import annotations

import math

RAD_PER_HZ = 2.0 * math.pi  # angular frequency [rad/s] over frequency [Hz]
_ANGLES = {"rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "deg": math.pi / 180, "arcmin": math.pi / 10800}
_LENGTHS = {"m": 1.0, "mm": 1e-3, "um": 1e-6}
_ACCELERATIONS = {"m/s^2": 1.0, "g": 9.80665}
_TORQUES = {"N m": 1.0, "mN m": 1e-3, "kN m": 1e3}
_FORCES = {"N": 1.0, "kN": 1e3}


_STRAINS = {"m/m": 1.0, "ustrain": 1e-6}


def _per_second(units: dict[str, float]) -> dict[str, float]:
    return {f"{unit}/s": factor for unit, factor in units.items()}


def _drift(units: dict[str, float]) -> dict[str, float]:
    """Return the units of a random walk."""
    return {f"{unit}/sqrt(s)": factor for unit, factor in units.items()}


UNITS: dict[str, dict[str, float]] = {
    "length": _LENGTHS,
    "area": {"m^2": 1.0, "mm^2": 1e-6},
    "second moment of area": {"m^4": 1.0, "mm^4": 1e-12},
    "mass": {"kg": 1.0, "g": 1e-3, "t": 1e3},
    "inertia": {"kg m^2": 1.0, "kg mm^2": 1e-6},
    "density": {"kg/m^3": 1.0},
    "pressure": {"Pa": 1.0, "bar": 1e5, "MPa": 1e6, "GPa": 1e9},
    "angle": _ANGLES,
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6},
    "frequency": {"Hz": 1.0, "kHz": 1e3},
    "acceleration": _ACCELERATIONS,
    "strain": _STRAINS,
    "ratio": {"": 1.0, "%": 1e-2},
    "velocity": _per_second(_LENGTHS),
    "angular velocity": _per_second(_ANGLES),
    "force": _FORCES,
    "torque": _TORQUES,
    "force rate": _per_second(_FORCES),
    "torque rate": _per_second(_TORQUES),
    "stiffness": {"N/m": 1.0, "N/mm": 1e3},
    "rotational stiffness": {"N m/rad": 1.0, "N m/deg": 180 / math.pi},
    "damping": {"N s/m": 1.0},
    "rotational damping": {"N m s/rad": 1.0},
    "damping rate": {"1/s": 1.0},
    "length drift": _drift(_LENGTHS),
    "angle drift": _drift(_ANGLES),
    "strain drift": _drift(_STRAINS),
    "acceleration drift": _drift(_ACCELERATIONS),
    "angular velocity drift": _drift(_per_second(_ANGLES)),
    "length rate": _per_second(_LENGTHS),
    "angle rate": _per_second(_ANGLES),
    "strain rate": _per_second(_STRAINS),
    "acceleration rate": _per_second(_ACCELERATIONS),
    "angular velocity rate": _per_second(_per_second(_ANGLES)),
}

_ALONG = {"position": "length", "inertia": "mass", "effort": "force", "effort rate": "force rate"}
_ABOUT = {
    "position": "angle",
    "velocity": "angular velocity",
    "effort": "torque",
    "effort rate": "torque rate",
    "stiffness": "rotational stiffness",
    "damping": "rotational damping",
}


def is_sliding(axis: str) -> bool:
    """Return whether an axis, "tx" or "leg.tx", slides; else it turns."""
    return axis.rpartition(".")[2].startswith("t")


def axis_dimension(axis: str, quantity: str) -> str:
    """Return the dimension of a quantity of an axis: the "position" of "rz" or "base.rz" is an angle."""
    return (_ALONG if is_sliding(axis) else _ABOUT).get(quantity, quantity)


def si_unit(dimension: str) -> str:
    """Return the unit in which values of a dimension are kept."""
    return next(iter(UNITS[dimension]))


def parse_quantity(text: object, dimension: str) -> float:
    """Return the SI value of "number unit".

    Args:
        text: What the file holds; a bare number only where the dimension is "ratio".
        dimension: A key of ``UNITS``.

    Raises:
        ValueError: Not a number, not finite, or a unit of another dimension; says what is allowed.
    """
    number, _, unit = (part.strip() for part in str(text).strip().partition(" "))
    if isinstance(text, bool) or not isinstance(text, int | float | str):
        raise ValueError(f"expected {_example(dimension)}")
    if unit not in UNITS[dimension]:
        wrong = f"unit '{unit}' is not one of {dimension}" if unit else "has no unit after a space"
        raise ValueError(f"{wrong}; expected {_example(dimension)}")
    try:
        if "_" in number:  # Python's own way to write 1000 as 1_000
            raise ValueError(number)
        value = float(number) * UNITS[dimension][unit]
    except ValueError:
        raise ValueError(f"'{number}' is not a number; expected {_example(dimension)}") from None
    if not math.isfinite(value):
        raise ValueError("must be finite")
    return value


def _example(dimension: str) -> str:
    units = [unit or "no unit" for unit in UNITS[dimension]]
    return f"a number with one of the units: {', '.join(units)}"
