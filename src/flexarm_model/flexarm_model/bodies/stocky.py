"""Beams that are too stocky for Euler and Bernoulli: what leaving out shear costs their first frequency.

A load at the place where the beam moves most gives in by bending and by shear, and the frequency goes with
the root of what gives in. With moment ``m(x)`` and shear force ``m'(x)``::

    error = sqrt(1 + int m'^2 / kappa G A dx / int m^2 / E I dx) - 1

``m = L - x`` for a beam held at its root with a load at its end, ``m = sin(pi x / L)`` for one between two
hinges (frame "chord"). More of a bare cantilever shears than of one with a load: it is 1.3 times as wrong.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from flexarm_model.bodies.beam import rigidities
from flexarm_model.manipulator.body_spec import Beam, BeamPiece, Body

PERCENT = 100.0
MATTERS = 0.01  # of the first frequency
EVEN = 5 / 6  # of an area that does not say how it bears shear, as a rectangle's without Poisson's ratio
_POINTS = 12  # of a piece: both shapes squared are smooth over the beam


def describe_stocky(bodies: Mapping[str, Body]) -> tuple[str, ...]:
    """Return a sentence that names the beams whose first frequency misses shear; none if there is none."""
    errors = {body.name: shear_error(body) for body in bodies.values() if isinstance(body, Beam)}
    found = ", ".join(f"{name} {PERCENT * error:.3g} %" for name, error in errors.items() if error > MATTERS)
    if not found:
        return ()
    return (
        f"for want of shear the first frequency of a stocky beam is too high, loaded where it moves most "
        f"by about: {found}; add the word shear to its deformation",
    )


def shear_error(beam: Beam) -> float:
    """Return by how much a beam's first frequency is too high for want of shear [1]; zero if it has that."""
    if "shear" in beam.deformation:
        return 0.0
    planes = [i for i, way in enumerate(("bend_y", "bend_z")) if way in beam.deformation]
    bent, sheared, start = np.zeros(2), np.zeros(2), 0.0  # along y, along z
    for piece in beam.pieces:
        if not piece.rigid:
            square, rate = _squares(beam, start, start + piece.length)
            bent += square / np.array(rigidities(piece)[:1:-1])
            sheared += rate / (piece.G * np.array(_shear_area(piece)))
        start += piece.length
    return max((float(np.sqrt(1 + sheared[i] / bent[i]) - 1) for i in planes), default=0.0)


def _shear_area(piece: BeamPiece) -> tuple[float, float]:
    return piece.shear_area or (EVEN * piece.area,) * 2


def _squares(beam: Beam, start: float, end: float) -> tuple[float, float]:
    """Return the integrals of m^2 [m^3] and m'^2 [m] over a piece; both m of the length of the beam."""
    point, weight = np.polynomial.legendre.leggauss(_POINTS)
    half, L = (end - start) / 2, beam.length
    x: NDArray[np.float64] = start + half * (1 + point)
    if beam.reduction.frame == "chord":
        m, rate = L / np.pi * np.sin(np.pi * x / L), np.cos(np.pi * x / L)
    else:
        m, rate = L - x, np.ones_like(x)
    return float(half * weight @ m**2), float(half * weight @ rate**2)
