"""Numbers of equal parts that no mode tells from each other, fitted as one.

Of an arm with equal legs a measured pair of modes may tell that one leg is softer, never which: a fit would
answer with any of them and be sure of it. Numbers of parts that are equal in all else are of that kind when
changing the one by what is expected of it moves all measured modes as changing the other does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_model.identification.modal_misfit import Serve, misfit
from flexarm_model.identification.mode_table import ModeTable
from flexarm_model.identification.unknown import Unknown

Array = NDArray[np.float64]
ALIKE = 1.0  # sigmas of all that was measured, between what two do that change as much as they may


def merged(serve: Serve, unknowns: Sequence[Unknown], tables: Sequence[ModeTable]) -> tuple[Unknown, ...]:
    """Return the unknowns, those that nothing tells apart as one, in their order.

    Args:
        serve: Modes of the changed description.
        unknowns: As they were named.
        tables: The measured modes, of a pose each.
    """
    kept: list[Unknown] = []
    moved: dict[Unknown, Array] = {}
    for unknown in unknowns:
        twins = [other for other in kept if _kind(other) == _kind(unknown)]
        for one in (*twins, unknown) if twins else ():
            if one not in moved:
                moved[one] = _moves(serve, one, tables)
        twin = next((other for other in twins if _is_alike(moved[unknown], moved[other])), None)
        if twin is None:
            kept.append(unknown)
            continue
        both = replace(twin, equals=(*twin.equals, *unknown.paths))
        moved[both] = moved[twin]
        kept[kept.index(twin)] = both
    return tuple(kept)


def _moves(serve: Serve, unknown: Unknown, tables: Sequence[ModeTable]) -> Array:
    """Return what is off when one changes by what is expected of it, in sigmas; nan without a model there."""
    try:
        return misfit(serve, [replace(unknown, equals=())], tables, np.array([unknown.spread]))[0]
    except ValueError:  # the fit will tell
        return np.full(1, np.nan)


def _is_alike(one: Array, other: Array) -> bool:
    return one.shape == other.shape and float(np.linalg.norm(one - other)) < ALIKE


def _kind(unknown: Unknown) -> tuple[object, ...]:
    """Return what equal numbers of equal parts have in common."""
    levels = unknown.path.split(".")
    return unknown.part, levels[0], tuple(levels[2:]), unknown.number, unknown.unit, unknown.spread
