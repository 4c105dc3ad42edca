"""Whether what surprises at one sensor surprises others, too: then something did happen to the arm."""

from __future__ import annotations

from collections.abc import Mapping

from flexarm_estimator.judging.short_term import SHIFT, ShortTerm
from flexarm_estimator.measurement import SAME_INSTANT

_ALSO = 3.0  # score of another mean that makes a shift doubtful
_OF_MEAN, _OF_JUMP = 0.9, 0.25  # and its least share of the own score, and of the size of the own jump


def is_common(sensor: str, reason: str, pasts: Mapping[str, ShortTerm]) -> bool:
    """Return whether others are surprised when a sensor is.

    Args:
        sensor: Who is surprised.
        reason: What would be said of it, ``HELD`` or ``SHIFT``.
        pasts: What every sensor has said lately.
    """
    own = pasts[sensor]
    others = [past for name, past in pasts.items() if name != sensor]
    at, size = own.surprise
    if any(abs(past.surprise[0] - at) <= SAME_INSTANT for past in others):
        return True
    least = max(_ALSO, _OF_MEAN * own.mean.score, _OF_JUMP * size)
    return reason == SHIFT and any(past.mean.score > least for past in others)
