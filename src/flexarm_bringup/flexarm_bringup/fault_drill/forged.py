"""Commands that nobody of us has sent, each wrong in one thing only, so that one check of the guard finds it.

They are made from the newest real command and begin as the one that will follow after the next: the token of
the session, its number, stamp and period. A torque a little beside the real one tells whether the guard has
let them through, without moving the arm.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from random import Random
from typing import Any

from flexarm_model.conversions import ns_to_stamp, stamp_to_ns

LEAD = 2  # periods by which they are newer than the real one: it takes a while until they arrive
MARK = 1e-3  # of the torque limit, and up to as much again
AHEAD = 20  # periods by which a stamp from the future is too early
USED = 10  # numbers that have been used
SPACED = 6  # real commands between two forged ones, of those that cost the real one its period
TOKEN_BITS = 62  # of a session

Spoil = Callable[[Any, int, Random], None]  # message, period [ns], randomness


@dataclass(frozen=True)
class Kind:
    """One way to forge commands.

    Attributes:
        name: What is wrong with them.
        spoil: Makes it wrong; None sends real commands once more as they are.
        count: How many are sent.
        every: Number of real commands between two of them.
        is_told: Every one must be counted as refused; else one may also never come to be looked at.
    """

    name: str
    spoil: Spoil | None
    count: int
    every: int = 1
    is_told: bool = True

    @property
    def is_made_up(self) -> bool:
        """Whether their torque tells them from real ones."""
        return self.spoil is not None

    def make(self, real: Sequence[Any], period_ns: int, limit: Sequence[float], random: Random) -> Any:
        """Return a command; ``real`` are real ones, the newest last, ``limit`` the largest torques."""
        if self.spoil is None:
            return random.choice(real)
        msg = following(real[-1], period_ns)
        marks = [MARK * (1.0 + random.random()) * most for most in limit]
        msg.effort = [tau + mark for tau, mark in zip(msg.effort, marks, strict=True)]
        self.spoil(msg, period_ns, random)
        return msg


def following(real: Any, period_ns: int) -> Any:
    """Return the command that will follow a real one after ``LEAD`` periods, but for its torque."""
    msg = copy.deepcopy(real)
    stamp_ns = stamp_to_ns(real.header.stamp)
    acts_ns = stamp_to_ns(real.acts_at) or stamp_ns + period_ns
    later_ns = LEAD * period_ns
    msg.header.stamp, msg.acts_at = ns_to_stamp(stamp_ns + later_ns), ns_to_stamp(acts_ns + later_ns)
    msg.sequence = real.sequence + LEAD
    return msg


def with_token(token: int) -> Spoil:
    """Return what gives a command another token."""

    def spoil(msg: Any, period_ns: int, random: Random) -> None:
        """Give it to a message."""
        msg.session_token = token

    return spoil


def guess(msg: Any, period_ns: int, random: Random) -> None:
    """Give a command a guessed token."""
    with_token(random.getrandbits(TOKEN_BITS) + 1)(msg, period_ns, random)


def move(msg: Any, periods: int, period_ns: int) -> None:
    """Give a command another stamp; it is still meant for the same period."""
    msg.header.stamp = ns_to_stamp(stamp_to_ns(msg.header.stamp) + periods * period_ns)


def _use_number(msg: Any, period_ns: int, random: Random) -> None:
    msg.sequence = max(msg.sequence - LEAD - random.randrange(USED), 0)


def _use_stamp(msg: Any, period_ns: int, random: Random) -> None:
    acts_ns, stamp_ns = stamp_to_ns(msg.acts_at), stamp_to_ns(msg.header.stamp)
    delay = round((acts_ns - stamp_ns) / period_ns)  # of these the newest real ones may not have acted yet
    move(msg, 1 - LEAD - delay - random.randrange(1, 4), period_ns)


def _come_from_the_future(msg: Any, period_ns: int, random: Random) -> None:
    move(msg, AHEAD, period_ns)


def _name_another_model(msg: Any, period_ns: int, random: Random) -> None:
    msg.model_id = f"{random.getrandbits(64):016x}"


def _name_other_axes(msg: Any, period_ns: int, random: Random) -> None:
    msg.names = random.choice(([], [f"{name}_of_another_arm" for name in msg.names]))


def _leave_right(msg: Any, period_ns: int, random: Random) -> None:
    pass


KINDS = (
    Kind("guessed token", guess, 250),
    Kind("number used before", _use_number, 250),
    Kind("real ones again", None, 250),
    Kind("other axes", _name_other_axes, 100),
    Kind("stamp used before", _use_stamp, 50, SPACED, is_told=False),
    Kind("stamp 20 periods ahead", _come_from_the_future, 50, SPACED, is_told=False),
    Kind("another model", _name_another_model, 50, SPACED, is_told=False),
)
RIGHT = Kind("nothing wrong", _leave_right, 20, SPACED, is_told=False)
