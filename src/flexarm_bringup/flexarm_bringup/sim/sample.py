"""What a sensor delivers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Sample(NamedTuple):  # not a dataclass: a dozen are made in every period
    """What a sensor delivers: value ``y`` (m,), SI, stamped with the instant ``tick``."""

    sensor: str
    kind: str
    tick: int
    y: Array
