"""How short an element of a beam may be.

An element of length h resists with EI / h^3 against the EI / L^3 of the beam: the shorter it is, the more of
the beam's stiffness is rounding, 1e-4 of it at h = L / 10000.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from flexarm_model.manipulator.body_spec import Beam, BeamPiece

SHORTEST = 1e-4  # an element's length over the beam's; shorter ones make the stiffness rounding
_ROUNDING = 1e-9  # of an element's length against the shortest one [m]: mesh nodes are rounded so


def short_elements(pieces: Sequence[BeamPiece]) -> Iterator[tuple[int, float, float]]:
    """Give the pieces whose elements are too short: index, length of an element, least length [m]."""
    shortest = SHORTEST * sum(piece.length for piece in pieces)
    for i, piece in enumerate(pieces):
        length = piece.length / piece.elements
        if not piece.rigid and length < shortest - _ROUNDING:
            yield i, length, shortest


def refuse_short_elements(beam: Beam) -> None:
    """Refuse a beam whose elements are too short.

    Raises:
        ValueError: A flexible piece has such elements; names beam and piece.
    """
    for i, length, shortest in short_elements(beam.pieces):
        raise ValueError(
            f"body '{beam.name}': the elements of pieces.{i} are {length:.3g} m long; they must be at "
            f"least {shortest:.3g} m (1/10000 of the beam), or rounding is all its stiffness"
        )
