"""A scan: what several sensors say at one instant, checked in one go; most samples come so.

Whatever is out of the ordinary in one of them is left to the checks of single samples, which say why.
"""

from __future__ import annotations

from collections.abc import Sequence
from operator import le
from struct import Struct
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.measurement import Measurement

Array = NDArray[np.float64]
_FLOAT = np.dtype(np.float64)


class Scan(NamedTuple):
    """Samples of one instant, of a sensor at most one, that nothing speaks against.

    Attributes:
        t: The instant [s].
        sensors: Who said something, in any order.
        data: What they said, one sensor below the other, as 64-bit floats in the order of the machine.
        samples: The same one by one.
    """

    t: float
    sensors: tuple[str, ...]
    data: bytes
    samples: Sequence[Measurement]

    @property
    def values(self) -> Array:
        """What they said, one sensor below the other, (m,)."""
        return np.frombuffer(self.data)


class Panel:
    """Sensors that speak together: what all their samples have to be like. One of no sensors reads nothing.

    Attributes:
        is_unused: It has never led to a scan.
    """

    def __init__(self, sensors: Sequence[tuple[tuple[int], float, float]]) -> None:
        """Take of every sensor the shape of its samples, and their least and largest value."""
        self._shapes = [shape for shape, _, _ in sensors]
        self._low = [low for (size,), low, _ in sensors for _ in range(size)]
        self._high = [high for (size,), _, high in sensors for _ in range(size)]
        self._unpack, self.is_unused = Struct(f"{len(self._low)}d").unpack, True

    def read(self, measurements: Sequence[Measurement], t: float) -> bytes:
        """Return what the sensors say at ``t`` [s] (``Scan.data``); nothing if one wants a closer look."""
        said: list[Any] = []  # arrays are buffers
        array = np.ndarray
        for (_, stamp, y, R), shape in zip(measurements, self._shapes, strict=False):
            if stamp != t or R is not None or type(y) is not array or y.dtype != _FLOAT or y.shape != shape:
                return b""
            said.append(y)
        try:
            data = b"".join(said)
        except ValueError:  # not contiguous
            return b""
        values = self._unpack(data)
        is_possible = all(map(le, self._low, values)) and all(map(le, values, self._high))
        return data if is_possible else b""


def split_newest(measurements: Sequence[Measurement]) -> tuple[list[Measurement], list[Measurement]]:
    """Return the newest samples without a covariance of their own, all of one instant, and the others."""
    newest = max([sample.t for sample in measurements])
    together = [sample for sample in measurements if sample.t == newest and sample.R is None]
    return together, [sample for sample in measurements if sample.t != newest or sample.R is not None]
