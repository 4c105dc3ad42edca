"""Whether some sensors together tell where all axes are.

An encoder tells its own axis, a camera those that move its tip.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
RANK = 0.05  # of singular values, rows of rad per rad or m per m


class Coverage:
    """Sets of sensors, as sums of their bits.

    Attributes:
        bits: Of every sensor that locates an axis, by name; another has none.
    """

    def __init__(self, axes: Mapping[str, Array]) -> None:
        """Take how every sensor follows the axes, (k, n_theta); see ``MeasurementModel.axes``.

        An axis that not even all together tell is not asked for.
        """
        self._rows = [rows for rows in axes.values() if rows.any()]
        names = [name for name, rows in axes.items() if rows.any()]
        self.bits = {name: 1 << i for i, name in enumerate(names)}
        self._wanted = self._rank((1 << len(names)) - 1)
        self._covers: dict[int, bool] = {0: False}

    def covers(self, sensors: int) -> bool:
        """Return whether a sum of bits tells all axes that can be told."""
        known = self._covers.get(sensors)
        if known is None:
            known = self._covers[sensors] = self._rank(sensors) == self._wanted
        return known

    def _rank(self, sensors: int) -> int:
        rows = [rows for i, rows in enumerate(self._rows) if sensors >> i & 1]
        return int(np.linalg.matrix_rank(np.vstack(rows), RANK)) if rows else 0
