"""What moved between two bags: the largest change of every field, beside its tolerance.

Integers are told exactly: a double has 53 bits, a session token 64.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.bags.bag_reader import Bag, decode
from flexarm_bringup.replaying.compare import Fit, Tolerance, grouped

Numbers = NDArray[np.float64] | NDArray[np.object_]  # the latter of integers of any size


@dataclass(frozen=True)
class Moved:
    """How far one field moved.

    Attributes:
        topic: Absolute topic.
        field: Without indices, "sensors.innovation".
        change: Largest |found - expected|, in the field's SI unit, whole of whole numbers; NaN where it is
            no number.
        size: Largest |expected|, whole of whole numbers.
        ratio: Largest change in tolerances [1]; infinite where none is allowed.
        stamp_ns: Where that is [ns].
        messages: How many messages have a change in it [1].
    """

    topic: str
    field: str
    change: int | float
    size: int | float
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
                ratios = change.astype(float) / allowed
            ratio = float(np.nan_to_num(ratios, nan=0.0, posinf=np.inf).max())
            yield Moved(topic, path, change.max(), _size(one), ratio, stamp_ns, 1)


def _difference(one: Any, other: Any) -> Numbers:
    """Return |other - one|, exact of integers, infinite where only one of them is a number."""
    if _is_whole(one) and _is_whole(other):
        return np.asarray(abs(_exact(other) - _exact(one)))
    a, b = np.asarray(one, float), np.asarray(other, float)
    with np.errstate(invalid="ignore"):
        change = np.where((a == b) | (np.isnan(a) & np.isnan(b)), 0.0, abs(b - a))
    return np.asarray(np.nan_to_num(change, nan=np.inf, posinf=np.inf))


def _size(value: Any) -> int | float:
    """Return the largest absolute value of a field, exact of integers."""
    if _is_whole(value):
        return int(abs(_exact(value)).max())
    return float(np.nan_to_num(abs(np.asarray(value, float))).max())


def _exact(value: Any) -> NDArray[np.object_]:
    """Return integers, (k,), as those of Python: no difference is too large for them."""
    return np.asarray(np.atleast_1d(value), dtype=object)


def _is_whole(value: Any) -> bool:
    return np.asarray(value).dtype.kind in "biu"


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float | np.number | np.ndarray)


def _larger(one: Moved, other: Moved) -> Moved:
    """Return both as one: the worse place, the largest of all numbers."""
    worse = other if other.ratio > one.ratio or other.change > one.change else one
    return Moved(
        one.topic,
        one.field,
        _most(one.change, other.change),
        _most(one.size, other.size),
        max(one.ratio, other.ratio),
        worse.stamp_ns,
        one.messages + other.messages,
    )


def _most(one: int | float, other: int | float) -> int | float:
    """Return the larger of two numbers, as it is; NaN only where both are."""
    return other if one != one or other > one else one
