"""Whether a description is as damped as the notes of its paper assume, so that a changed one is missed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.page.check import Check

BOUND = 1e-5  # relative: a description has six digits of 6/258


def damping_check(modes: str, zeta: NDArray[np.float64], noted: float) -> Check:
    """Return whether damping ratios are the one of the notes.

    Args:
        modes: Which modes of the description, for the name of the check.
        zeta: Their damping ratios [1], (n,).
        noted: That of the notes [1].
    """
    found = f"{zeta.min():.6g} … {zeta.max():.6g}"
    met = bool((abs(zeta / noted - 1.0) <= BOUND).all())
    return Check(f"damping ratio of {modes}, as described", f"{noted:.6g} (± {BOUND:g} of it)", found, met)
