"""Which identified mode is which mode of the description: the nearest one, and again once it is fitted.

A description is off, so before the fit a mode that noise or the band's edge made up may be the nearest of a
described one that was never excited. Parameters move modes together, so after the fit what is left is alike
in all: a pair that is off by far more or less than the others is none.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_model.identification.mode_table import ModeTable
from flexarm_model.modal.fit import PoleFit

Array = NDArray[np.float64]
FURTHEST = 0.5  # of ln f: a mode further off than that is another one
FITTED = 0.2  # the same, from what all modes are off by, once the description is fitted


def match(described_hz: Array, pose: Array, fit: PoleFit, furthest: float = FURTHEST) -> ModeTable:
    """Return the identified modes in the places of the described ones that they are nearest to.

    Args:
        described_hz: Frequencies of the description [Hz], (n,).
        pose: Actuated axes [rad or m], (n_theta,).
        fit: The identified modes; an infinite sigma of a damping says that it is not known.
        furthest: ln f by which two may differ that are one mode [1].

    Raises:
        ValueError: None is near.
    """
    far = abs(np.log(described_hz[:, None] / fit.model.f_hz[None, :]))
    rows, columns = scipy.optimize.linear_sum_assignment(np.minimum(far, 2.0 * furthest))
    pairs = [(r, c) for r, c in zip(rows, columns, strict=True) if far[r, c] < furthest]
    if not pairs:
        raise ValueError(
            f"identified {np.round(fit.model.f_hz, 2)} Hz, described {np.round(described_hz[:6], 2)} Hz: "
            "no two belong together"
        )
    f, f_std, zeta, zeta_std = np.full((4, max(r for r, _ in pairs) + 1), np.nan)
    for r, c in pairs:
        f[r], f_std[r] = fit.model.f_hz[c], fit.f_std_hz[c]
        if not np.isinf(fit.zeta_std[c]):
            zeta[r], zeta_std[r] = fit.model.zeta[c], fit.zeta_std[c]
    return ModeTable(pose, f, f_std, zeta, zeta_std)


def match_again(fitted_hz: Array, table: ModeTable, fit: PoleFit) -> ModeTable:
    """Return the modes in the places of the fitted description's, what all are off by taken out.

    Args:
        fitted_hz: Frequencies of the fitted description [Hz], (n,).
        table: As they were matched for that fit.
        fit: The identified modes.
    """
    errors = np.log(table.f_hz / fitted_hz[: table.f_hz.size])
    errors = errors[np.isfinite(errors)]
    apart = abs(errors[:, None] - errors[None, :]).sum(axis=1)
    common = errors[np.lexsort((abs(errors), apart))[0]]  # nearest to all others; of two the smaller
    return match(fitted_hz * np.exp(common), table.pose, fit, FITTED)


def is_same(one: ModeTable, other: ModeTable) -> bool:
    """Tell whether two tables have the same identified modes in the same places."""
    return bool(np.array_equal(one.f_hz, other.f_hz, equal_nan=True))


def strangers(first: Sequence[ModeTable], last: Sequence[ModeTable]) -> tuple[float, ...]:
    """Return the frequencies that had a place before the fit, which nobody has after it [Hz]."""
    found = []
    for table, fitted in zip(first, last, strict=True):
        kept = np.full(table.f_hz.size, np.nan)
        kept[: fitted.f_hz.size] = fitted.f_hz[: kept.size]
        found += table.f_hz[np.isfinite(table.f_hz) & np.isnan(kept)].tolist()
    return tuple(found)
