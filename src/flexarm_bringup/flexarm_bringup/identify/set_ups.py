"""Set-ups of one test: do they agree on the responses that more than one of them measured?

A sensor that roves or a hammer at another place makes new cells of the matrix; a cell that comes twice (the
reference point) shows whether gain and phase stayed what they were. With ``g = a^H b / a^H a`` over the lines
where both are coherent, ``|g|`` is the scale of b over a, and what is left of b is their difference.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from flexarm_bringup.identify.measurement import Cell, Responses, SourceError

TOLD = 0.02  # change of scale that is told
REFUSED = 0.2  # change of scale with which set-ups are not one test any more
COHERENT = 0.8
PERCENT = 100.0


def check_scale(parts: Sequence[Responses]) -> tuple[str, ...]:
    """Return what is to be told of cells that several set-ups measured.

    Raises:
        SourceError: The scale of one changed so much that the set-ups are not one test.
    """
    told = []
    for (i, first), (j, second) in combinations(enumerate(parts, 1), 2):
        for cell, scale, left in _common(first, second):
            text = (
                f"{cell[0]}/{cell[1]} is {PERCENT * abs(scale):.1f} % in set-up {j} of what it is in set-up "
                f"{i}, {PERCENT * left:.1f} % of it differs otherwise"
            )
            if not abs(abs(scale) - 1) <= REFUSED:
                raise SourceError(f"{text}: gain or wiring changed; these set-ups are not one test")
            if abs(abs(scale) - 1) > TOLD or left > REFUSED:
                told.append(text)
    if len(parts) > 1 and not any(True for a, b in combinations(parts, 2) for _ in _common(a, b)):
        told.append("no response was measured in two set-ups: nothing shows that they have the same scale")
    return tuple(told)


def _common(first: Responses, second: Responses) -> Iterator[tuple[Cell, complex, float]]:
    """Yield the cells of both, with scale and relative difference [1]."""
    for cell in first.cells:
        if cell not in second.cells:
            continue
        lines = np.ones(first.f_hz.size, bool)
        for part in (first, second):
            if cell in part.coherence:
                lines &= part.coherence[cell] >= COHERENT
        a, b = first.cells[cell][lines], second.cells[cell][lines]
        power = float(np.vdot(a, a).real)
        if power:
            scale = complex(np.vdot(a, b) / power)
            yield cell, scale, float(np.linalg.norm(b - scale * a)) / max(float(np.linalg.norm(b)), 1e-300)
