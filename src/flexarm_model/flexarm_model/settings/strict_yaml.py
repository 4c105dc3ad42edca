"""YAML that is never guessed at: every key is asked for once, with what it may hold.

``Section`` hands out the values of a mapping; a key nobody asked for, a missing key, a value of
the wrong kind, a unit of another dimension or a duplicate key raises ``ConfigError`` with file,
key, value and what is allowed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from difflib import get_close_matches
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_model.settings.units import parse_quantity
from flexarm_model.settings.yaml_file import ConfigError, read_yaml

__all__ = ["ConfigError", "Section", "read_yaml"]

_MISSING: Any = object()
SHOWN = 80  # characters of a wrong value in a message


class Section:
    """One mapping of the file, read key by key and closed by ``done``."""

    def __init__(self, content: object, path: str, key: str = "") -> None:
        """Start reading.

        Args:
            content: What the file holds there.
            path: File, for messages.
            key: Dotted key of this mapping, for messages.

        Raises:
            ConfigError: It is not a mapping with text keys.
        """
        self.path, self.key = path, key
        if not isinstance(content, dict) or not all(isinstance(name, str) for name in content):
            raise self.error("", content, "a mapping of names to values")
        self._content: dict[str, Any] = content
        self._asked: set[str] = set()

    def error(self, key: str, value: object, allowed: str) -> ConfigError:
        """Return the error for ``key``: file, key, value, what is allowed."""
        text = repr(value)
        shown = text if len(text) <= SHOWN else f"{text[:SHOWN]} ..."
        return ConfigError(f"{self.path}: {self._inside(key) or 'top level'}: {shown}: {allowed}")

    def take(self, key: str, default: Any = _MISSING) -> Any:
        """Return the raw value of ``key``."""
        self._asked.add(key)
        if key in self._content:
            return self._content[key]
        if default is _MISSING:
            similar = get_close_matches(key, set(self._content) - self._asked, 1)
            instead = f", not '{similar[0]}'" if similar else ""
            raise ConfigError(f"{self.path}: {self._inside(key)}: is missing; it must be given{instead}")
        return default

    def has(self, key: str) -> bool:
        """Return whether ``key`` is given; it counts as asked for."""
        self._asked.add(key)
        return key in self._content

    def quantity(
        self,
        key: str,
        dimension: str,
        default: float | None = None,
        *,
        above: float | None = None,
        at_least: float | None = None,
        below: float | None = None,
    ) -> float:
        """Return the SI value of a quantity, checked against bounds."""
        value = self.take(key, _MISSING if default is None else default)
        if key not in self._content:
            return float(value)
        number = self._number(key, value, dimension)
        if above is not None and not number > above:
            raise self.error(key, value, f"must be above {above:g}")
        if at_least is not None and not number >= at_least:
            raise self.error(key, value, f"must be at least {at_least:g}")
        if below is not None and not number < below:
            raise self.error(key, value, f"must be below {below:g}")
        return number

    def quantities(
        self, key: str, dimensions: Sequence[str], default: Sequence[float] | None = None, names: str = ""
    ) -> NDArray[np.float64]:
        """Return a list of quantities, one of each dimension, (n,); ``names`` of them go into messages."""
        value = self.take(key, _MISSING if default is None else default)
        if key not in self._content:
            return np.array(value, dtype=float)
        if not isinstance(value, list) or len(value) != len(dimensions):
            listed = f": {names}" if names else ""
            raise self.error(key, value, f"expected a list of {len(dimensions)}{listed}")
        pairs = zip(value, dimensions, strict=True)
        return np.array([self._number(key, item, dimension) for item, dimension in pairs])

    def text(self, key: str, default: str | None = None) -> str:
        """Return a text."""
        value = self.take(key, _MISSING if default is None else default)
        if not isinstance(value, str):
            raise self.error(key, value, "expected a text")
        return value

    def texts(self, key: str, default: Sequence[str] | None = None) -> tuple[str, ...]:
        """Return a list of texts."""
        value = self.take(key, _MISSING if default is None else list(default))
        if not isinstance(value, list) or not all(isinstance(item, str) for item in value):
            raise self.error(key, value, "expected a list of texts")
        return tuple(value)

    def choice(self, key: str, allowed: Sequence[str], default: str | None = None) -> str:
        """Return one of the texts allowed."""
        value = self.take(key, _MISSING if default is None else default)
        if value not in allowed:
            raise self.error(key, value, f"expected one of {', '.join(allowed)}")
        return str(value)

    def choices(
        self, key: str, allowed: Sequence[str], default: Sequence[str] | None = None, *, at_least: int = 0
    ) -> tuple[str, ...]:
        """Return a list without repetition out of the texts allowed, in their order."""
        value = self.texts(key, default)
        if len(value) < at_least:
            raise self.error(key, list(value), f"expected at least {at_least} of {', '.join(allowed)}")
        if len(set(value)) != len(value) or not set(value) <= set(allowed):
            raise self.error(key, list(value), f"expected some of {', '.join(allowed)}, each once")
        return tuple(item for item in allowed if item in value)

    def count(
        self, key: str, default: int | None = None, *, at_least: int = 1, at_most: float = math.inf
    ) -> int:
        """Return a whole number."""
        value = self.take(key, _MISSING if default is None else default)
        if not isinstance(value, int) or isinstance(value, bool) or not at_least <= value <= at_most:
            most = f", at most {at_most:g}" if math.isfinite(at_most) else ""
            raise self.error(key, value, f"expected a whole number, at least {at_least}{most}")
        return value

    def flag(self, key: str, default: bool = False) -> bool:
        """Return true or false."""
        value = self.take(key, default)
        if not isinstance(value, bool):
            raise self.error(key, value, "expected true or false")
        return value

    def section(self, key: str, default: dict[str, Any] | None = None) -> Section:
        """Return a mapping inside this one."""
        return Section(self.take(key, _MISSING if default is None else default), self.path, self._inside(key))

    def sections(self, key: str, default: dict[str, Any] | None = None) -> Iterator[tuple[str, Section]]:
        """Yield every named mapping under ``key``."""
        outer = self.section(key, default)
        for name in outer.names():
            yield name, outer.section(name)

    def names(self, taken: Sequence[str] = (), *, dots: bool = False) -> tuple[str, ...]:
        """Return the names that this mapping gives to its values.

        Args:
            taken: Names that mean something else.
            dots: Whether a name may hold dots.
        """
        for name in self._content:
            if not name or ("." in name and not dots) or name in taken:
                others = f", other than {', '.join(taken)}" if taken else ""
                raise self.error(name, name, f"expected a name without a dot{others}")
        return tuple(self._content)

    def items(self, key: str, default: Sequence[Any] | None = None) -> Iterator[Section]:
        """Yield every mapping of a list."""
        value = self.take(key, _MISSING if default is None else list(default))
        if not isinstance(value, list):
            raise self.error(key, value, "expected a list")
        for index, item in enumerate(value):
            yield Section(item, self.path, f"{self._inside(key)}.{index}")

    def done(self) -> None:
        """Refuse the keys that nobody asked for."""
        for key in self._content:
            if key not in self._asked:
                allowed = ", ".join(sorted(self._asked)) or "nothing"
                raise self.error(key, self._content[key], f"unknown key; allowed here: {allowed}")

    def _inside(self, key: str) -> str:
        return ".".join(part for part in (self.key, key) if part)

    def _number(self, key: str, value: object, dimension: str) -> float:
        try:
            return parse_quantity(value, dimension)
        except ValueError as error:
            raise self.error(key, value, str(error)) from None
