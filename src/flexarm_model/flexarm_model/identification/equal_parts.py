"""Numbers of equal parts that no mode tells from each other, fitted as one.

Of an arm with equal legs a measured pair of modes may tell that one leg is softer, never which: a fit would
answer with any of them and be sure of it. Numbers are of that kind when changing the one moves all measured
modes as changing the other does.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flexarm_model.identification.modal_misfit import Serve, misfit
from flexarm_model.identification.mode_table import ModeTable
from flexarm_model.identification.unknown import Unknown

STEP = 0.1  # of ln p, by which they are tried
ALIKE = 1.0  # sigmas of all that was measured, between what two of them do


def merged(serve: Serve, unknowns: Sequence[Unknown], tables: Sequence[ModeTable]) -> tuple[Unknown, ...]:
    """Return the unknowns, those that nothing tells apart as one, with the smaller spread of theirs.

    Raises:
        ValueError: The model has fewer modes than a table.
    """
    kept: list[Unknown] = []
    moved: list[np.ndarray | None] = []
    for unknown in unknowns:
        try:
            moves = misfit(serve, [unknown], tables, np.array([STEP]))[0]
        except ValueError:  # no model there: the fit will tell
            moves = None
        twin = next((i for i, other in enumerate(kept) if _is_alike(unknown, other, moves, moved[i])), None)
        if twin is None:
            kept.append(unknown)
            moved.append(moves)
        else:
            spread = min(unknown.spread, kept[twin].spread)
            kept[twin] = replace(kept[twin], spread=spread, equals=(*kept[twin].equals, *unknown.paths))
    return tuple(kept)


def _is_alike(one: Unknown, other: Unknown, moves: np.ndarray | None, moved: np.ndarray | None) -> bool:
    """Tell whether two are the same number of their parts, and move everything alike."""
    if moves is None or moved is None or _kind(one) != _kind(other):
        return False
    return float(np.linalg.norm(moves - moved)) < ALIKE


def _kind(unknown: Unknown) -> tuple[object, ...]:
    """Return what equal numbers of equal parts have in common."""
    levels = unknown.path.split(".")
    return levels[0], len(levels), levels[-1], unknown.number, unknown.unit
