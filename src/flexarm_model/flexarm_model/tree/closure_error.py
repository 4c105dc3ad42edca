"""Why a loop of the manipulator cannot be closed."""

from __future__ import annotations


class ClosureError(ValueError):
    """The loops do not close, or the pose is singular; the message names manipulator and pose."""
