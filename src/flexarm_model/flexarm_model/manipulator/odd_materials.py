"""What of a beam's material and section is odd and may be meant; what cannot be is refused as it is read.

Ranges hold what is made [Ashby2017, charts of modulus and density]: density from foams to osmium, Young's
modulus from rubber to diamond. What is denser than glass is a metal or a ceramic, and none is as soft as a
polymer. Poisson's ratio ``E / 2G - 1`` lies within 0 and 1/2 unless there are fibres or a foam. An area has
at least the moments of an ellipse: ``I_y I_z >= (A^2 / 4 pi)^2``; less is that of a core which bears alone.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from flexarm_model.manipulator.body_spec import Beam, BeamPiece, Body

DENSITY = (20.0, 25e3)  # kg/m^3
MODULUS = (10e6, 1300e9)  # Pa
DENSE, SOFT = 2500.0, 1e9  # kg/m^3; Pa: a metal is not as soft
PRINTED = 0.01  # of a figure: two or three digits


def describe_odd_materials(bodies: Mapping[str, Body]) -> tuple[str, ...]:
    """Return a sentence for everything odd, each with the key that it is about."""
    return tuple(
        f"bodies.{body.name}.pieces.{i}.{said}"
        for body in bodies.values()
        if isinstance(body, Beam)
        for i, piece in enumerate(body.pieces)
        if not piece.rigid
        for said in _odd(piece)
    )


def _odd(piece: BeamPiece) -> Iterator[str]:
    """Yield what is odd of a flexible piece."""
    low, high = DENSITY
    if piece.density and not low <= piece.density <= high:
        yield f"density: {piece.density:.4g} kg/m^3; materials have {low:g} to {high:g}"
    softest, stiffest = MODULUS
    if not softest <= piece.E <= stiffest:
        yield f"youngs_modulus: {piece.E:.4g} Pa; materials have {softest:g} to {stiffest:g}"
    elif piece.density > DENSE and piece.E < SOFT:
        yield f"youngs_modulus: {piece.E:.4g} Pa; above {DENSE:g} kg/m^3 materials have more than {SOFT:g}"
    yield from _odd_shear_modulus(piece)
    least = piece.area**2 / (4 * np.pi)
    if np.sqrt(piece.I_y * piece.I_z) < (1 - PRINTED) * least:
        yield f"section: I_y and I_z are too small for its area; a rod has {least:.4g} m^4 of each"


def _odd_shear_modulus(piece: BeamPiece) -> Iterator[str]:
    nu = f"Poisson's ratio {piece.E / (2 * piece.G) - 1:.3g}"
    if piece.G < (1 - PRINTED) * piece.E / 3:
        yield f"shear_modulus: {piece.G:.4g} Pa is below a third of Young's, {nu}; fibres alone make that"
    if piece.G > (1 + PRINTED) * piece.E / 2:
        yield f"shear_modulus: {piece.G:.4g} Pa is above half of Young's, {nu}; expected 0 to 0.5"
