"""Parameter files of row 47: thirteen for every node, each wrong in one way, and what a refusal must name."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import Field, dataclass
from pathlib import Path
from typing import Any

from flexarm_bringup.parameters_command import parameters_of
from flexarm_bringup.topics import NAMESPACE

MISSING = None  # there is no such file


@dataclass(frozen=True)
class BadFile:
    """One wrong parameter file.

    Attributes:
        name: What is wrong, in a word or two.
        text: Its content; None when it does not exist.
        names: What the message must name beside the file: key, value, and what is allowed.
    """

    name: str
    text: str | None
    names: tuple[str, ...]

    def write(self, folder: Path) -> Path:
        """Write it, unless it is the one that is missing; return its path."""
        path = folder / f"{self.name.replace(' ', '_')}.yaml"
        if self.text is not None:
            path.write_text(self.text, encoding="utf8")
        return path


def bad_files(node: str) -> tuple[BadFile, ...]:
    """Return the thirteen wrong files of a node, by its name in ``parameters_command.NODES``."""
    settings = tuple(parameters_of(node))
    number, listed = _number(settings), _list_of_wrong_length(settings)
    name = f"{NAMESPACE}/{node}"
    own = "manipulator"

    def bad(what: str, key: str, value: str, *allowed: str) -> BadFile:
        """Return a file in which one key is wrong."""
        return BadFile(what, f"{name}:\n  ros__parameters:\n    {key}: {value}\n", (name, key, *allowed))

    allowed = _allowed(number)
    return (
        bad("not a number", number.name, ".nan", "nan", *allowed),
        bad("infinite", number.name, ".inf", "inf", *allowed),
        bad("negative", number.name, "-1.0e+9", "-1", *allowed),
        bad("out of range", number.name, "1.0e+300", "1e+300", *allowed),
        bad("wrong type", number.name, "fast", "fast", *allowed),
        bad(*listed),
        bad("misspelt key", "manipulater", "single_link", "allowed: ", own),
        bad("unknown manipulator", own, "single_lnk", "single_link", ".yaml"),
        BadFile(
            "duplicate key", _section(name, f"{own}: single_link\n    {own}: planar_3rrr"), (own, "once")
        ),
        BadFile("wrong node", _section(f"{name}r", f"{own}: single_link"), (f"{name}r", "allowed: ", name)),
        BadFile("empty", "", ("must hold keys and values",)),
        BadFile("not YAML", f"{name}: [not, parameters\n", ("is not YAML", "line 2")),
        BadFile("missing", MISSING, ("cannot be read",)),
    )


def _section(name: str, values: str) -> str:
    return f"{name}:\n  ros__parameters:\n    {values}\n"


def _number(settings: Sequence[Field[Any]]) -> Field[Any]:
    """Return the first number with a range; the first switch of a node that has no number."""
    numbers = (item for item in settings if isinstance(item.default, float) and _is_bounded(item))
    switches = (item for item in settings if isinstance(item.default, bool))
    return next(numbers, None) or next(switches)


def _is_bounded(item: Field[Any]) -> bool:
    return all(math.isfinite(item.metadata[end]) for end in ("minimum", "maximum"))


def _allowed(item: Field[Any]) -> tuple[str, ...]:
    if isinstance(item.default, bool):
        return ("true or false",)
    return tuple(str(item.metadata[end]) for end in ("minimum", "maximum"))


def _list_of_wrong_length(settings: Sequence[Field[Any]]) -> tuple[str, str, str, str]:
    """Return name, key, value and what is allowed; where no list has a length, a list for one text."""
    if any(item.name == "start" for item in settings):
        return "list of wrong length", "start", f"[{', '.join(['0.0'] * 99)}]", "expected one each for"
    return "list for one value", "preset", "[geared, light]", "is not a text"
