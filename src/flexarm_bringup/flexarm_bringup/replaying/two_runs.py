"""Are two bags of one run, or of two? What is drawn anew in every run is then no difference.

The guard draws a session token whenever it is armed, so bags that share one are of one run: a recording, and
what was replayed of it.
"""

from __future__ import annotations

from flexarm_bringup.bags.bag_reader import Bag, decode
from flexarm_bringup.replaying.compare import IGNORED, Tolerance, grouped
from flexarm_bringup.topics import NAMESPACE
from flexarm_model.conversions import NS_PER_S

COMMANDS, STATES = f"{NAMESPACE}/joint_commands", f"{NAMESPACE}/joint_states"
DRAWN = (Tolerance("joint_commands.session_token", IGNORED, 0.0),)


def are_two_runs(one: Bag, other: Bag) -> bool:
    """Return whether both bags hold commands, of sessions of their own."""
    ours, theirs = _tokens(one), _tokens(other)
    return bool(ours and theirs) and not ours & theirs


def how_they_end(one: Bag, other: Bag) -> str:
    """Return how much of two runs is compared, in words."""
    ours, theirs = (max((at for _, at in grouped(bag, [STATES])), default=0) for bag in (one, other))
    apart = abs(ours - theirs) / NS_PER_S
    shorter = one if ours < theirs else other
    until = f", until {shorter.path} ends, {apart:.3g} s before the other" if apart else ""
    return f" Two runs are compared{until}; their session tokens are not."


def _tokens(bag: Bag) -> set[int]:
    tokens = {decode(record).session_token for record in bag.records if record.name == COMMANDS}
    return tokens - {0}
