"""The ``pieces`` of a beam: sections, materials, elements."""

from __future__ import annotations

from collections.abc import Sequence

from flexarm_model.bodies.short_elements import short_elements
from flexarm_model.manipulator.body_spec import BeamPiece
from flexarm_model.manipulator.shear_coefficient import poissons_ratio
from flexarm_model.reading.config_sections import SectionFigures, read_section
from flexarm_model.settings.strict_yaml import Section

MOST_ELEMENTS = 200  # of a piece; the time that a body takes grows with their third power
NU = 0.3  # Poisson's ratio where no shear modulus is given


def read_pieces(section: Section, *, shear: bool) -> tuple[BeamPiece, ...]:
    """Read the pieces of a beam.

    Args:
        section: Of the beam.
        shear: Whether its deformation names shear, which needs shear moduli and areas.

    Raises:
        ConfigError: A value is wrong or missing; see ``strict_yaml``.
    """
    pieces = tuple(_read_piece(item, shear) for item in section.items("pieces"))
    if not pieces:
        raise section.error("pieces", [], "expected at least one piece")
    _refuse_short_elements(section, pieces)
    return pieces


def _refuse_short_elements(section: Section, pieces: Sequence[BeamPiece]) -> None:
    for i, length, least in short_elements(pieces):
        allowed = (
            f"its elements are {length:.3g} m long, {least:.3g} m is the least (1/10000 of the beam), or "
            "rounding is all its stiffness: give the piece fewer, make it rigid, or part of its neighbour"
        )
        raise section.error(f"pieces.{i}.elements", pieces[i].elements, allowed)


def _read_piece(item: Section, shear: bool) -> BeamPiece:
    if item.flag("rigid"):
        return _read_rigid_piece(item)
    figures = read_section(item)
    E = item.quantity("youngs_modulus", "pressure", above=0.0)
    if shear:
        _refuse_without_shear(item, figures)
    G = _read_shear_modulus(item, E)
    piece = BeamPiece(
        length=item.quantity("length", "length", above=0.0),
        area=figures.area,
        I_y=figures.I_y,
        I_z=figures.I_z,
        torsion_constant=figures.torsion_constant,
        E=E,
        G=G,
        density=item.quantity("density", "density", at_least=0.0),
        elements=item.count("elements", at_most=MOST_ELEMENTS),
        axial_rigidity=item.quantity("axial_rigidity", "force", above=0.0)
        if item.has("axial_rigidity")
        else None,
        reach=figures.reach,
        shear_area=figures.shear_area(poissons_ratio(E, G)) if figures.shear_area else None,
    )
    item.done()
    return piece


def _read_shear_modulus(item: Section, E: float) -> float:
    """Return G [Pa]; one above E would be a Poisson's ratio below -1/2.

    Above E / 2 it is odd, but a Young's modulus that was fitted to frequencies may come to lie so.
    """
    G = item.quantity("shear_modulus", "pressure", E / (2 * (1 + NU)), above=0.0)
    if G > E:
        allowed = f"is above Young's modulus, {E:.6g} Pa; a plain material has a third to half of that"
        raise item.error("shear_modulus", item.take("shear_modulus"), allowed)
    return G


def _refuse_without_shear(item: Section, figures: SectionFigures) -> None:
    """Raise ConfigError where a piece does not say how it resists the shear of its beam."""
    why = "must be given, since the beam's deformation names shear"
    if not item.has("shear_modulus"):
        raise item.error("shear_modulus", None, why)
    if figures.shear_area is None:
        allowed = f"{why}: the areas that bear it evenly, [along y, along z], such as [80 mm^2, 60 mm^2]"
        raise item.error("section.shear_area", None, allowed)


def _read_rigid_piece(item: Section) -> BeamPiece:
    """Return a piece without mass that does not deform; what it weighs is a point mass."""
    length = item.quantity("length", "length", above=0.0)
    item.done()
    return BeamPiece(length, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, density=0.0, elements=1, rigid=True)
