"""A guard that is blind to one thing that may be wrong with a command; not a test itself.

Run as a program it is the guard node; the environment says to what it is blind: BLIND_TO, of ``BLINDFOLDS``.
"""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Callable
from typing import Any

import pytest

from flexarm_controller.guard import Guard, GuardCommand
from flexarm_controller.guard_exchange import GuardExchange

Patch = pytest.MonkeyPatch
Refuse = Callable[[Guard, GuardCommand, float], str]


class Seen:
    """A command of which the guard sees something else than there is."""

    def __init__(self, msg: Any, **seen: Any) -> None:
        self._msg = msg
        self.__dict__.update(seen)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._msg, name)


def see(patch: Patch, look: Callable[[GuardExchange, Any], Any]) -> None:
    """Let the guard take, instead of a message, what ``look`` makes of it."""
    sound = GuardExchange.on_command
    patch.setattr(GuardExchange, "on_command", lambda self, msg: sound(self, look(self, msg)))


def judge(patch: Patch, refuse: Callable[[Refuse, Guard, GuardCommand, float], str]) -> None:
    """Let ``refuse`` judge commands; it gets the sound judgement as its first argument."""
    sound = Guard._refuse
    patch.setattr(Guard, "_refuse", lambda self, command, t: refuse(sound, self, command, t))


def blind_to_token(patch: Patch) -> None:
    see(patch, lambda self, msg: Seen(msg, session_token=self.guard.token) if self.guard.token else msg)
    judge(patch, lambda sound, guard, command, t: sound(guard, command._replace(token=guard.token), t))


def blind_to_number(patch: Patch) -> None:
    def look(exchange: GuardExchange, msg: Any) -> Any:
        exchange._newest = exchange._newest[0], -1
        return msg

    def refuse(sound: Refuse, guard: Guard, command: GuardCommand, t: float) -> str:
        guard._sequence = -1
        return sound(guard, command, t)

    see(patch, look)
    judge(patch, refuse)


def blind_to_used_stamp(patch: Patch) -> None:
    def refuse(sound: Refuse, guard: Guard, command: GuardCommand, t: float) -> str:
        used, guard._used = guard._used, -math.inf
        refusal = sound(guard, command, t)
        guard._used = used
        return refusal

    judge(patch, refuse)


def blind_to_age(patch: Patch) -> None:
    def refuse(sound: Refuse, guard: Guard, command: GuardCommand, t: float) -> str:
        refusal = sound(guard, command, t)
        return "" if refusal.endswith("ms old") else refusal

    judge(patch, refuse)


def blind_to_model(patch: Patch) -> None:
    judge(patch, lambda sound, guard, command, t: sound(guard, command._replace(model_id=guard.model_id), t))


def blind_to_axes(patch: Patch) -> None:
    see(patch, lambda self, msg: Seen(msg, names=self.names))


BLINDFOLDS = {
    "token": blind_to_token,
    "number": blind_to_number,
    "used stamp": blind_to_used_stamp,
    "age": blind_to_age,
    "model": blind_to_model,
    "axes": blind_to_axes,
}

if __name__ == "__main__":
    from flexarm_controller.guard_node import GuardNode
    from flexarm_model.ros.node import run_node

    BLINDFOLDS[os.environ["BLIND_TO"]](pytest.MonkeyPatch())
    sys.exit(run_node(GuardNode))
