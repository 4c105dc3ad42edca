"""What a reserve makes of its arm while it waits: a node that is called then has it at once.

A node's module may say what takes its node long: ``AHEAD = (GuardExchange, GuardSettings, None)`` is
``GuardExchange(arm, settings, None)``, where settings are a ``GuardSettings``, they and the arm those of the
command line. Its node asks for it with ``made``, the same function and the same arguments. Anything else is
made when it is asked for, as always.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from importlib import import_module
from typing import Any, TypeVar

import yaml

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.start_pose import starting_at
from flexarm_model.process.ros_arguments import values_of
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.arm_settings import ArmSettings
from flexarm_model.settings.parameters import parameter

T = TypeVar("T")
_MADE: list[tuple[tuple[Any, ...], Any]] = []  # what is asked for, and it; each is given away once


@dataclass(frozen=True)
class _PlacedArm(ArmSettings):
    start: tuple[float, ...] = parameter((), "Axes at the start; empty: home.", "rad or m")


def made(how: Callable[..., T], arm: ManipulatorConfig, *more: Any) -> T:
    """Return ``how(arm, *more)``, which may have been made ahead; who asks again gets another."""
    asked = _asked(how, arm, more)
    for index, (key, _) in enumerate(_MADE):
        if key == asked:
            return _MADE.pop(index)[1]  # type: ignore[no-any-return]
    return how(arm, *more)


def make_ahead(module: str, arguments: Sequence[str]) -> None:
    """Make what a node's module says; nothing where it says nothing.

    Args:
        module: Full name.
        arguments: Command line of the node.

    Raises:
        ConfigError: There is no such arm or preset any more.
    """
    ahead = getattr(import_module(module), "AHEAD", None)
    if ahead is None:
        return
    placed = _told(_PlacedArm, arguments)
    arm = starting_at(load_config(find_manipulator(placed.manipulator), placed.preset), placed.start)
    how, *kinds = ahead
    more = tuple(_told(kind, arguments) if isinstance(kind, type) else kind for kind in kinds)
    _MADE.append((_asked(how, arm, more), how(arm, *more)))


def _told(kind: type[T], arguments: Sequence[str]) -> T:
    """Return settings of a class as ``-p key:=value`` gives them, defaults where it says nothing."""
    typed = (item.partition(":=") for item in values_of(arguments, ("-p", "--param")))
    given = {key: yaml.safe_load(value) for key, _, value in typed}
    names = [each.name for each in fields(kind) if each.name in given]  # type: ignore[arg-type]
    return kind(**{name: tuple(v) if isinstance(v := given[name], list) else v for name in names})


def _asked(how: Callable[..., Any], arm: ManipulatorConfig, more: tuple[Any, ...]) -> tuple[Any, ...]:
    return (how, arm.config_id, arm.preset, tuple(arm.home), *more)
