"""Why a motion is refused: the text names axis, quantity, value, limit."""

from __future__ import annotations


class MotionError(ValueError):
    """A motion that was asked for is impossible within the limits; the text says why."""
