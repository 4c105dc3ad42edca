"""Models that come in one go, ahead of their motion, are taken one by one, in the time that a period leaves.

A motion may have a hundred of them. What a node makes of one takes milliseconds, and messages are handed over
in the order in which they came, so all that waits behind them, states and sensors, would wait until the last
one is taken: longer than the guard waits for a command. Nor may one follow the other where each takes most of
a period: after one there is a pause as long as it took. A model whose time has come is taken at once.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from typing import Any

from flexarm_model.conversions import stamp_to_ns

QUIET = 0.1  # s without a step, after which nothing has to wait


class ArrivingModels:
    """What has come and is not taken yet, in order of arrival."""

    def __init__(
        self, take: Callable[[Any], None], is_paced: bool, clock: Callable[[], float] = time.perf_counter
    ) -> None:
        """Begin with nothing.

        Args:
            take: Takes a model (ReducedModel message).
            is_paced: In real time; in lockstep every model is taken when it comes.
            clock: Returns the time now [s].
        """
        self._take, self._is_paced, self._clock = take, is_paced, clock
        self._waiting: deque[Any] = deque()
        self._stepped = self._rested = -math.inf

    def add(self, msg: Any) -> None:
        """Keep a model for later, or take it at once where nobody waits for a step."""
        self._waiting.append(msg)
        self.look()

    def look(self) -> None:
        """Take all when the last step is long ago; to be called now and then."""
        if not (self._is_paced and self._clock() - self._stepped < QUIET):
            self._take_first(len(self._waiting))

    def take_due(self, stamp_ns: int) -> None:
        """Take what is to be used from ``stamp_ns`` [ns] on or before, and what came before that."""
        stamps = [stamp_to_ns(msg.header.stamp) for msg in self._waiting]
        self._take_first(max((i + 1 for i, at in enumerate(stamps) if at <= stamp_ns), default=0))

    def work_ahead(self) -> None:
        """Note that a step is done, and take one model in the time that is left, if the last was long ago."""
        self._stepped = begin = self._clock()
        if self._waiting and begin >= self._rested:
            self._take_first(1)
            end = self._clock()
            self._rested = end + (end - begin)

    def _take_first(self, count: int) -> None:
        for _ in range(count):
            self._take(self._waiting.popleft())
