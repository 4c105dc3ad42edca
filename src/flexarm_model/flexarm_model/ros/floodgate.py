"""A topic on which somebody may speak as fast as he can: heard at once, or polled while it is flooded.

To hear a message costs an executor some microseconds whatever is in it; fifty thousand a second leave a node,
and who shares its core, no time for anything else. So a subscription that brings more than a few messages in
a period is taken from the executor, and what waits then is looked at once or twice a period; the rest is
lost, and costs nothing here. It is heard at once again when the flood is over.
"""

from __future__ import annotations

from typing import Any

MOST = 20  # messages in a period; one is ordinary, and some after a period that was missed
LONGEST = 64  # messages that are looked at in one go
CALM = 200  # periods with fewer, after which the topic is heard at once again


class Floodgate:
    """Stands before one subscription of a managed node.

    Attributes:
        is_closed: The topic is flooded; it is polled.
    """

    def __init__(self, node: Any, subscription: Any) -> None:
        """Hear the subscription at once; its callback stays what it is."""
        self._node, self._subscription = node, subscription
        self._take, subscription.callback = subscription.callback, self._hear
        self.is_closed = False
        self._came = self._calm = 0

    def begin_period(self) -> None:
        """Look at what waits, if it is flooded; to be called once a period."""
        if self.is_closed:
            self._calm = self._calm + 1 if self._came < MOST else 0
            if self._calm >= CALM:
                self._turn(is_closed=False)
        self._came = 0
        self.poll()

    def poll(self) -> None:
        """Look at what waits, if it is flooded."""
        for _ in range(LONGEST if self.is_closed else 0):
            taken = self._subscription.handle.take_message(self._subscription.msg_type, True)
            if taken is None:
                return
            self._came += 1
            self._take(taken[0])

    def _hear(self, raw: bytes) -> None:
        self._came += 1
        self._take(raw)
        if self._came > MOST and not self.is_closed:
            self._turn(is_closed=True)

    def _turn(self, *, is_closed: bool) -> None:
        """Take the subscription from the executor, or give it back."""
        self.is_closed, self._calm = is_closed, 0
        others = tuple(each for each in self._node.polled if each is not self._subscription)
        self._node.polled = (*others, self._subscription) if is_closed else others
        self._node.executor.wake()
