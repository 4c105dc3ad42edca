"""A flooded topic is polled, with a bound on what is looked at, and is heard at once again later."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from flexarm_model.ros.floodgate import CALM, LONGEST, MOST, Floodgate


class Bench:
    """A node with one subscription, what waits in it, and what its callback has seen."""

    def __init__(self) -> None:
        self.waiting: list[bytes] = []
        self.seen: list[bytes] = []
        self.woken = 0
        handle = SimpleNamespace(take_message=self.take)
        self.subscription: Any = SimpleNamespace(handle=handle, msg_type=bytes, callback=self.seen.append)
        self.node = SimpleNamespace(polled=(), executor=SimpleNamespace(wake=self.wake))
        self.gate = Floodgate(self.node, self.subscription)

    def take(self, kind: type, raw: bool) -> tuple[bytes, None] | None:
        assert raw
        return (self.waiting.pop(0), None) if self.waiting else None

    def wake(self) -> None:
        self.woken += 1

    def hear(self, count: int) -> None:
        """Let an executor deliver messages."""
        for k in range(count):
            self.subscription.callback(b"%d" % k)


def test_ordinary_messages_are_heard_at_once() -> None:
    bench = Bench()
    for _ in range(10):
        bench.gate.begin_period()
        bench.hear(MOST)
    assert len(bench.seen) == 10 * MOST
    assert not (bench.gate.is_closed or bench.node.polled or bench.woken)


def test_a_flood_is_polled_with_a_bound_until_it_is_over() -> None:
    bench = Bench()
    bench.hear(MOST + 1)
    assert bench.gate.is_closed and bench.node.polled == (bench.subscription,) and bench.woken == 1
    for _ in range(3):
        bench.waiting = [b"x"] * 1000
        seen = len(bench.seen)
        bench.gate.begin_period()
        bench.gate.poll()
        assert len(bench.seen) - seen == 2 * LONGEST
    bench.waiting = []
    for k in range(CALM + 1):
        assert bench.gate.is_closed, k
        bench.waiting = [b"one of its own"]
        bench.gate.begin_period()
    assert not bench.gate.is_closed and not bench.node.polled and bench.woken == 2
    bench.hear(1)
    assert bench.seen[-1] == b"0"


def test_a_flood_that_goes_on_stays_polled() -> None:
    bench = Bench()
    bench.hear(MOST + 1)
    for k in range(3 * CALM):
        bench.waiting = [b"x"] * (MOST if k % (CALM // 2) == 0 else 1)
        bench.gate.begin_period()
    assert bench.gate.is_closed
