"""Set-ups of one test: do they agree on the responses that more than one of them measured?

A sensor that roves or a hammer at another place makes new cells of the matrix; a cell that comes twice (the
reference point) shows whether gain and phase stayed what they were. With ``g = a^H b / a^H a`` over the lines
where both are coherent, ``|g|`` is the scale of b over a, its angle the phase between them, and what is left
of b is their difference. A mode that the mass of a sensor shifts by half a bandwidth turns the phase by 27
degrees, another polarity turns it by 180, a velocity taken for an acceleration by 90.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from flexarm_bringup.identify.measurement import Cell, Responses, SourceError

TOLD = 0.02  # change of scale that is told
REFUSED = 0.2  # change of scale with which set-ups are not one test any more
TOLD_DEG, REFUSED_DEG = 2.0, 30.0  # the same of the phase
OTHER_SIGN_DEG = 150.0  # phase from which a response has the other sign
COHERENT = 0.8
PERCENT = 100.0


def check_scale(parts: Sequence[Responses]) -> tuple[str, ...]:
    """Return what is to be told of cells that several set-ups measured.

    Raises:
        SourceError: Scale, sign or phase of one changed so much that the set-ups are not one test; names the
            response, both set-ups and what changed.
    """
    told = []
    for (i, first), (j, second) in combinations(enumerate(parts, 1), 2):
        for cell, scale, left in _common(first, second):
            turned = float(np.rad2deg(np.angle(scale)))
            text = _compared(cell, (i, j), scale, left)
            if not (abs(abs(scale) - 1) <= REFUSED and abs(turned) <= REFUSED_DEG):
                raise SourceError(f"{text}: {_changed(cell, turned)}; these set-ups are not one test")
            if abs(abs(scale) - 1) > TOLD or abs(turned) > TOLD_DEG or left > REFUSED:
                told.append(text)
    if len(parts) > 1 and not any(True for a, b in combinations(parts, 2) for _ in _common(a, b)):
        told.append("no response was measured in two set-ups: nothing shows that they have the same scale")
    return tuple(told)


def _compared(cell: Cell, set_ups: tuple[int, int], scale: complex, left: float) -> str:
    """Return what a response is in the second of two set-ups of what it is in the first."""
    turned = float(np.rad2deg(np.angle(scale)))
    sign = "of the other sign, " if abs(turned) >= OTHER_SIGN_DEG else ""
    return (
        f"{cell[0]}/{cell[1]} is {PERCENT * abs(scale):.1f} % in set-up {set_ups[1]} of what it is in set-up "
        f"{set_ups[0]}, {sign}{turned:+.1f} degrees of phase, {PERCENT * left:.1f} % of it differs otherwise"
    )


def _changed(cell: Cell, turned: float) -> str:
    """Return what may have happened to a response whose phase turned by so many degrees."""
    if abs(turned) >= OTHER_SIGN_DEG:
        return f"direction or polarity of {cell[0]} or of {cell[1]} changed"
    if abs(turned) > REFUSED_DEG:
        return f"{cell[0]} or {cell[1]} means another quantity, is late, or the modes moved"
    return "gain or wiring changed"


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
