"""When the arm moved so that its sensors can be told right or wrong.

A channel at three instants ``a, m, b`` that are evenly apart: ``y_a - 2 y_m + y_b`` is noise while the arm
rests, whatever the channel's offset, and while it moves evenly. Beyond ``_FAR`` sigma it accelerates or
vibrates. A window in which many channels show that is worth more than one in which a fine one shows much.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.isolation.channels import Channels
from flexarm_estimator.measurement import Measurement

Array = NDArray[np.float64]
_LOOKS = 5  # over a window, its ends included
_KEPT = 8  # windows, each a look after the other
_FAR = 10.0  # sigma of a single sample


class Excitation:
    """Looks at what the channels say, evenly apart in time.

    Attributes:
        is_seen: There is a window in which the arm moved.
    """

    def __init__(self, channels: Channels, length: int) -> None:
        """Begin with nothing seen; windows have ``length`` ticks."""
        self._channels, self._apart = channels, length // (_LOOKS - 1)
        self._looks: deque[Array] = deque(maxlen=_LOOKS)
        self._strengths: deque[float] = deque(maxlen=_KEPT)  # of the window that ends with each look
        self._since = 0  # ticks since the newest look
        self.is_seen = False

    def tick(self, samples: Sequence[Measurement]) -> None:
        """Note what the sensors say, now and then."""
        self._since += 1
        if self._since < self._apart:
            return
        self._since = 0
        said, spans = self._channels.silence(1)[0], self._channels.spans
        for sample in samples:
            if sample.sensor in spans:
                said[spans[sample.sensor]] = sample.y
        self._looks.append(said)
        if len(self._looks) == _LOOKS:
            self._strengths.append(self._strength())
            self.is_seen = any(self._strengths)

    def find(self, newest: int) -> int | None:
        """Return how many ticks ago the window ended in which the arm moved most; None: it was at rest.

        Only windows count that ended less than ``newest`` ticks ago.
        """
        best, ago = 0.0, None
        for i, strength in enumerate(reversed(self._strengths)):
            ended = self._since + i * self._apart
            if ended >= newest:
                break
            if strength > best:
                best, ago = strength, ended
        return ago

    def _strength(self) -> float:
        """Return how much the channels curve over the newest window; 0 where none does beyond noise."""
        said = np.array(self._looks)
        curves = np.nan_to_num(np.abs(said[:-2] - 2.0 * said[1:-1] + said[2:])) / self._channels.sigma
        largest = curves.max(axis=0)
        return float(np.log1p(largest).sum()) if largest.max(initial=0.0) > _FAR else 0.0
