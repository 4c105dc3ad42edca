"""The ``section`` of a beam's piece: its figures from its shape."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from flexarm_model.manipulator import shear_coefficient
from flexarm_model.settings.strict_yaml import Section

PRINTED = 0.01  # of a figure: what two or three digits leave undecided


@dataclass(frozen=True)
class SectionFigures:
    """A section.

    Attributes:
        area: Its area [m^2].
        I_y, I_z: Second moments about y and z [m^4].
        torsion_constant: Saint-Venant's J [m^4].
        reach: How far it goes from the axis along y and z [m]; inf where that is not known.
        shear_area: Poisson's ratio -> areas that bear shear along y and z evenly [m^2]; None where nobody
            says.
    """

    area: float
    I_y: float
    I_z: float
    torsion_constant: float
    reach: tuple[float, float]
    shear_area: Callable[[float], tuple[float, float]] | None


def read_section(item: Section) -> SectionFigures:
    """Read the section of a piece.

    Raises:
        ConfigError: A value is wrong; see ``strict_yaml``.
    """
    shape = item.section("section")
    figures = _SHAPES[shape.choice("shape", tuple(_SHAPES))](shape)
    shape.done()
    return figures


def _rectangle(shape: Section) -> SectionFigures:
    """Return the figures of a rectangle [Roark, table 10.7]."""
    y = shape.quantity("along_y", "length", above=0.0)
    z = shape.quantity("along_z", "length", above=0.0)
    a, b = max(y, z) / 2, min(y, z) / 2
    torsion = a * b**3 * (16 / 3 - 3.36 * b / a * (1 - b**4 / (12 * a**4)))

    def shear_area(nu: float) -> tuple[float, float]:
        """Return the areas that bear shear along y and z [m^2]."""
        return (y * z * shear_coefficient.of_rectangle(nu),) * 2

    return SectionFigures(y * z, y * z**3 / 12, z * y**3 / 12, torsion, (y / 2, z / 2), shear_area)


def _tube(shape: Section) -> SectionFigures:
    """Return the figures of a round tube or rod."""
    outer = shape.quantity("outer_diameter", "length", above=0.0)
    inner = shape.quantity("inner_diameter", "length", 0.0, at_least=0.0)
    if not inner < outer:
        raise shape.error("inner_diameter", inner, f"must be below the outer diameter, {outer:g} m")
    second = math.pi * (outer**4 - inner**4) / 64
    area = math.pi * (outer**2 - inner**2) / 4

    def shear_area(nu: float) -> tuple[float, float]:
        """Return the areas that bear shear along y and z [m^2]."""
        return (area * shear_coefficient.of_tube(nu, inner / outer),) * 2

    return SectionFigures(area, second, second, 2 * second, (outer / 2, outer / 2), shear_area)


def _box(shape: Section) -> SectionFigures:
    """Return the figures of a box; torsion constant 4 A_m^2 t / s (Bredt) [Roark, table 10.7]."""
    y = shape.quantity("along_y", "length", above=0.0)
    z = shape.quantity("along_z", "length", above=0.0)
    wall = shape.quantity("wall", "length", above=0.0)
    if not 2 * wall < min(y, z):
        raise shape.error("wall", wall, f"must be below half the narrower side, {min(y, z) / 2:g} m")
    inner_y, inner_z, middle_y, middle_z = y - 2 * wall, z - 2 * wall, y - wall, z - wall
    torsion = 2 * wall * (middle_y * middle_z) ** 2 / (middle_y + middle_z)
    I_y, I_z = (y * z**3 - inner_y * inner_z**3) / 12, (z * y**3 - inner_z * inner_y**3) / 12
    area = y * z - inner_y * inner_z

    def shear_area(nu: float) -> tuple[float, float]:
        """Return the areas that bear shear along y and z [m^2]."""
        along_y = area * shear_coefficient.of_box(nu, middle_y, middle_z)
        return along_y, area * shear_coefficient.of_box(nu, middle_z, middle_y)

    return SectionFigures(area, I_y, I_z, torsion, (y / 2, z / 2), shear_area)


def _given(shape: Section) -> SectionFigures:
    """Return section properties that are told as numbers."""
    moments = (shape.quantity(f"I_{axis}", "second moment of area", above=0.0) for axis in "yz")
    area, I_y, I_z = shape.quantity("area", "area", above=0.0), *moments
    torsion = shape.quantity("torsion_constant", "second moment of area", above=0.0)
    if torsion > (I_y + I_z) * (1 + PRINTED):
        allowed = f"must be at most I_y + I_z, {I_y + I_z:.6g} m^4, which only round sections reach"
        raise shape.error("torsion_constant", shape.take("torsion_constant"), allowed)
    return SectionFigures(area, I_y, I_z, torsion, (math.inf, math.inf), _given_shear_area(shape))


def _given_shear_area(shape: Section) -> Callable[[float], tuple[float, float]] | None:
    """Return the areas that a section is told to bear shear with, if it is."""
    if not shape.has("shear_area"):
        return None
    y, z = (float(value) for value in shape.quantities("shear_area", ["area"] * 2))
    if min(y, z) <= 0.0:
        raise shape.error("shear_area", shape.take("shear_area"), "must both be above 0, along y and along z")
    return lambda nu: (y, z)


_SHAPES: dict[str, Callable[[Section], SectionFigures]] = {
    "rectangle": _rectangle,
    "tube": _tube,
    "given": _given,
    "box": _box,
}
