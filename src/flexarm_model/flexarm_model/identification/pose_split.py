"""Poses that a fitted description has not seen: do its frequencies hold there?

A parameter that is wrong can make up for another at the poses it was fitted at, not at others. The last third
of the poses is kept back from the fit, at least one of two.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from flexarm_model.identification.modal_misfit import Serve
from flexarm_model.identification.mode_table import ModeTable

KEPT_BACK = 1 / 3  # of the poses


@dataclass(frozen=True)
class PoseTest:
    """Frequencies at poses kept back, model over measured minus one, RMS.

    Attributes:
        poses: Their number.
        before, after: With the description as it was, and fitted at the other poses [1].
    """

    poses: int
    before: float
    after: float

    @property
    def holds(self) -> bool:
        """The fit has not made other poses worse."""
        return self.after <= self.before


def split_poses(tables: Sequence[ModeTable]) -> tuple[Sequence[ModeTable], Sequence[ModeTable]]:
    """Return tables to fit and tables to test; one alone is fitted."""
    kept = math.ceil(KEPT_BACK * len(tables)) if len(tables) > 1 else 0
    return tables[: len(tables) - kept], tables[len(tables) - kept :]


def check_poses(
    serve: Serve, changes: Mapping[str, str | float], tables: Sequence[ModeTable]
) -> PoseTest | None:
    """Return what fitted changes are worth at poses kept back; None when there are none.

    Raises:
        ValueError: With them there is no model at one of the poses.
    """
    if not tables:
        return None
    before = _error(serve, {}, tables)
    try:
        after = _error(serve, changes, tables)
    except ValueError as error:
        values = ", ".join(f"{path} = {value}" for path, value in changes.items())
        raise ValueError(f"the fitted values have no model at a pose kept back: {values}: {error}") from None
    return PoseTest(len(tables), before, after)


def _error(serve: Serve, changes: Mapping[str, str | float], tables: Sequence[ModeTable]) -> float:
    errors = [serve(changes, table.pose)[0][: table.f_hz.size] / table.f_hz - 1.0 for table in tables]
    return float(np.sqrt(np.nanmean(np.concatenate(errors) ** 2)))
