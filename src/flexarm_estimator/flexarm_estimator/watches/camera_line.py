"""Frames of one camera: they wait until the tip is known around them, are compared, and tell the delay."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.measurement import Measurement
from flexarm_estimator.watches.latency_fit import Latency, LatencyFit
from flexarm_estimator.watches.stamp_alarm import StampAlarm
from flexarm_estimator.watches.tip_track import TipTrack

Array = NDArray[np.float64]
EARLIEST, LATEST = -0.02, 0.2  # s; the delays that are compared
_STEP = 0.005  # s, between them
_PATIENCE = 0.04  # s; a frame is compared so much after its stamp, when the tip is known on both sides
_MOST_WAITING = 100  # frames


class CameraLine:
    """Frames of one camera, and what they say.

    Attributes:
        camera: Its name.
        alarm: What is said of its stamps.
        latency: Delay as it was found out last; None before.
        due_at: When the next frame can be compared [s]; infinity when none waits.
        unread: Time over which frames have been compared since the delay was found out [s].
        is_searched: It has been looked for a change since.
    """

    def __init__(self, camera: str, memory: float) -> None:
        """Start without frames; one counts 1/e after ``memory`` [s]."""
        self.camera, self.alarm = camera, StampAlarm(camera)
        self.latency: Latency | None = None
        count = round((LATEST - EARLIEST) / _STEP) + 1
        self._fit = LatencyFit(np.linspace(EARLIEST, LATEST, count), memory)
        self._waiting: deque[tuple[float, Array]] = deque(maxlen=_MOST_WAITING)
        self._last, self.unread, self.due_at = math.nan, 0.0, math.inf
        self.is_searched = False

    def wait(self, sample: Measurement, delay: float) -> None:
        """Keep a frame until the tip is known around its stamp, which was ``delay`` [s] later."""
        self._waiting.append((sample.t + delay, np.array(sample.y[:3])))
        self._look_ahead()

    def compare(self, track: TipTrack, t: float) -> None:
        """Add the frames that are due at ``t`` [s]."""
        while self.due_at <= t:
            stamp, position = self._waiting.popleft()
            self._look_ahead()
            if not track.covers(stamp - LATEST, stamp - EARLIEST):
                continue
            since = max(0.0, stamp - self._last) if math.isfinite(self._last) else 0.0
            self._last = stamp
            self.unread += since
            self._fit.compare(track, stamp, position, since)

    def search(self, noise: float) -> None:
        """Forget what was before a change of the delay; ``noise`` as for ``read``."""
        self._fit.drop_what_was_before_a_change(noise)
        self.is_searched = True

    def read(self, noise: float) -> float:
        """Find out the delay; return the time since that was done before [s].

        Args:
            noise: Variance of the predicted positions [m^2].
        """
        elapsed, self.unread, self.is_searched = self.unread, 0.0, False
        self.latency = self._fit.result(noise)
        return elapsed

    def _look_ahead(self) -> None:
        self.due_at = self._waiting[0][0] + _PATIENCE if self._waiting else math.inf
