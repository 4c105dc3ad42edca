"""What moved between two bags: the largest change of every field, beside its tolerance."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.bags.bag_reader import Bag, decode
from flexarm_bringup.replaying.compare import Fit, Tolerance, grouped

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Moved:
    """How far one field moved.

    Attributes:
        topic: Absolute topic.
        field: Without indices, "sensors.innovation".
        change: Largest |found - expected|, in the field's SI unit; NaN where it is no number.
        size: Largest |expected|.
        ratio: Largest change in tolerances [1]; infinite where none is allowed.
        stamp_ns: Where that is [ns].
        messages: How many messages have a change in it [1].
    """

    topic: str
    field: str
    change: float
    size: float
    ratio: float
    stamp_ns: int
    messages: int


def find_moved(
    expected: Bag, found: Bag, topics: Sequence[str], tolerances: Sequence[Tolerance]
) -> list[Moved]:
    """Return what moved, the field that is furthest beyond its tolerance first."""
    ours, theirs = grouped(expected, topics), grouped(found, topics)
    moved: dict[tuple[str, str], Moved] = {}
    fits = {topic: Fit(topic, tolerances) for topic in topics}
    for topic, stamp_ns in sorted(ours, key=lambda key: key[1]):
        pairs = zip(ours[topic, stamp_ns], theirs[topic, stamp_ns], strict=False)
        for one, other in ((a, b) for a, b in pairs if a.cdr != b.cdr):
            for item in _changes(topic, stamp_ns, decode(one), decode(other), fits[topic]):
                key = topic, item.field
                moved[key] = _larger(moved[key], item) if key in moved else item
    return sorted(moved.values(), key=lambda item: (-item.ratio, item.topic, item.field))


def leaves(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield what a message holds by field without indices, arrays and texts whole, and how long lists are."""
    if is_dataclass(value):
        for item in fields(value):
            yield from leaves(getattr(value, item.name), f"{path}.{item.name}".lstrip("."))
    elif isinstance(value, list) and value and is_dataclass(value[0]):
        yield path, f"{len(value)} element(s)"
        for item in value:
            yield from leaves(item, path)
    else:
        yield path, value


def _changes(topic: str, stamp_ns: int, a: Any, b: Any, fit: Fit) -> Iterator[Moved]:
    for (path, one), (other_path, other) in zip(leaves(a), leaves(b), strict=False):
        if path != other_path:
            return  # lists of other lengths, named already
        if type(one) is type(other) and np.array_equal(one, other):  # as most are
            continue
        tolerance = fit(path)
        if not _is_number(one) or not _is_number(other) or np.shape(one) != np.shape(other):
            if not np.array_equal(one, other):
                ratio = 0.0 if np.isinf(tolerance.atol) else np.inf
                yield Moved(topic, path, np.nan, np.nan, ratio, stamp_ns, 1)
            continue
        change, allowed = (
            _difference(one, other),
            tolerance.atol + tolerance.rtol * abs(np.asarray(one, float)),
        )
        if change.size and change.max() > 0.0:
            with np.errstate(divide="ignore", invalid="ignore"):
                ratio = float(np.nan_to_num(change / allowed, nan=0.0, posinf=np.inf).max())
            size = float(np.nan_to_num(abs(np.asarray(one, float))).max())
            yield Moved(topic, path, float(change.max()), size, ratio, stamp_ns, 1)


def _difference(one: Any, other: Any) -> Array:
    """Return |other - one|, infinite where only one of them is a number."""
    a, b = np.asarray(one, float), np.asarray(other, float)
    with np.errstate(invalid="ignore"):
        change = np.where((a == b) | (np.isnan(a) & np.isnan(b)), 0.0, abs(b - a))
    return np.asarray(np.nan_to_num(change, nan=np.inf, posinf=np.inf))


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.number | np.ndarray)


def _larger(one: Moved, other: Moved) -> Moved:
    """Return both as one: the worse place, the largest of all numbers."""
    worse = other if other.ratio > one.ratio or other.change > one.change else one
    return Moved(
        one.topic,
        one.field,
        float(np.nanmax([one.change, other.change])) if one.change == one.change else other.change,
        float(np.nanmax([one.size, other.size])) if one.size == one.size else other.size,
        max(one.ratio, other.ratio),
        worse.stamp_ns,
        one.messages + other.messages,
    )
