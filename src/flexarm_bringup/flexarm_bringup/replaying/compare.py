"""Where two bags differ: every field of every message, within the tolerance of that field.

Two numbers a, b of a field agree when ``|a - b| <= atol + rtol |a|``; NaN agrees with NaN; strings,
integers and lengths must be equal. Messages are paired by topic, stamp and order, so that one that
is missing or too many is named and does not shift the rest; the time of their arrival does not matter.
A recording may end in the middle of an instant: from its last stamp on, numbers of messages are free. Nodes
do not end all at once: a topic that ends within ``CLOSING_NS`` of the recording may go on in the other bag.
Between two replays of one bag nothing is free: both end with it. Of two runs both may end anywhere.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass
from fnmatch import fnmatchcase
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.bags.bag_reader import Bag, Record, decode
from flexarm_bringup.bags.cdr import header_stamp_ns
from flexarm_bringup.topics import NAMESPACE, find_stream

IGNORED = float("inf")
CLOSING_NS = 50_000_000  # so long the drives move on without a command, and the clock of lockstep with them


@dataclass(frozen=True)
class Tolerance:
    """How far a field may differ.

    Attributes:
        pattern: "topic.field", relative topic, with ``*`` for anything.
        atol: Absolute tolerance in the field's SI unit; infinite: not compared.
        rtol: Relative tolerance [1].
    """

    pattern: str
    atol: float
    rtol: float


# The first pattern that fits holds. The numbers allow for another processor's order of summation,
# amplified by a few hundred steps, and stay far below the sensors' noise.
TOLERANCES = (
    Tolerance("model.model_id", IGNORED, 0.0),  # hash of the last bits
    Tolerance("model.*", 1e-9, 1e-6),
    Tolerance("controller_status.solve_time", IGNORED, 0.0),  # time of the processor, not of the arm
    Tolerance("controller_status.iterations", IGNORED, 0.0),  # near the tolerance one more is no news
    Tolerance("controller_status.residual", 1e-5, 0.0),  # below what the solver is asked for
    Tolerance("controller_debug.*_time", IGNORED, 0.0),
    Tolerance("controller_debug.iterations", IGNORED, 0.0),
    Tolerance("controller_debug.tip.*", 1e-7, 1e-6),  # m; the torque's tolerance after a horizon
    Tolerance("controller_debug.*energy", 1e-9, 1e-3),  # J; quadratic in the amplitude
    Tolerance("joint_commands.effort", 1e-4, 1e-5),  # N m; the solver's tolerance times the torque range
    Tolerance("controller_status.tracking_error", 1e-9, 1e-6),
    Tolerance("modal_state.sensors.normalised_innovation", 1e-6, 1e-6),
    Tolerance("modal_state.*", 1e-9, 1e-6),
    Tolerance("end_effector.*", 1e-9, 1e-6),
)
EXACT = Tolerance("*", 0.0, 0.0)


@dataclass(frozen=True)
class Divergence:
    """One difference.

    Attributes:
        stamp_ns: Stamp of the message; log time where it has none [ns].
        topic: Absolute topic.
        field: Field, e.g. "sensors[2].innovation[0]"; empty when a message is missing or too many.
        text: What was expected and what was found.
    """

    stamp_ns: int
    topic: str
    field: str
    text: str

    def __str__(self) -> str:
        where = f"{self.topic}.{self.field}" if self.field else self.topic
        return f"{self.stamp_ns * 1e-9:.9f} s  {where}: {self.text}"


@dataclass(frozen=True)
class Comparison:
    """Result of a comparison.

    Attributes:
        compared: Messages compared by absolute topic [1].
        divergences: The first difference of every message that differs, by stamp.
    """

    compared: dict[str, int]
    divergences: tuple[Divergence, ...]

    @property
    def is_equal(self) -> bool:
        """Whether nothing differs."""
        return not self.divergences


def compare_bags(
    expected: Bag,
    found: Bag,
    topics: Sequence[str],
    tolerances: Sequence[Tolerance] = TOLERANCES,
    *,
    free_end: bool = True,
    are_runs: bool = False,
) -> Comparison:
    """Compare the messages of two bags on some topics.

    Args:
        expected: The golden bag.
        found: The bag to judge.
        topics: Absolute topics to compare.
        tolerances: First fitting pattern holds; fields that none fits must be equal.
        free_end: Whether the golden bag is a recording, of which the last instant may be half.
        are_runs: Whether both bags are of runs of their own: what one has after the other's end is free.
    """
    ours, theirs = grouped(expected, topics), grouped(found, topics)
    rank = {topic: i for i, topic in enumerate(topics)}
    divergences = []
    compared = dict.fromkeys(topics, 0)
    ends = _ends(ours, topics) if free_end else dict.fromkeys(topics, math.inf)
    if are_runs:
        ends = {topic: min(ends[topic], end) for topic, end in _ends(theirs, topics).items()}
    fits = {topic: Fit(topic, tolerances) for topic in topics}
    for key in sorted({*ours, *theirs}, key=lambda key: (key[1], rank[key[0]])):
        topic, stamp_ns = key
        compared[topic] += min(len(ours[key]), len(theirs[key]))
        differences = _differences(ours[key], theirs[key], fits[topic])
        if stamp_ns < ends[topic]:
            differences = chain(_surplus(ours[key], theirs[key]), differences)
        divergences += [Divergence(stamp_ns, topic, field, text) for field, text in differences]
    return Comparison(compared, tuple(divergences))


def _ends(groups: Iterable[tuple[str, int]], topics: Sequence[str]) -> dict[str, float]:
    """Return from which stamp on [ns] numbers of messages are free, by topic."""
    last = dict.fromkeys(topics, 0)
    for topic, stamp_ns in groups:
        last[topic] = max(last[topic], stamp_ns)
    end_ns = max(last.values(), default=0)
    return {topic: at + 1 if end_ns - CLOSING_NS < at < end_ns else end_ns for topic, at in last.items()}


def grouped(bag: Bag, topics: Sequence[str]) -> defaultdict[tuple[str, int], list[Record]]:
    """Return messages by topic and stamp [ns], in the order written."""
    groups: defaultdict[tuple[str, int], list[Record]] = defaultdict(list)
    for record in bag.records:
        if record.name in topics:
            stream = find_stream(record.name)
            is_stamped = stream is not None and stream.is_stamped
            stamp_ns = header_stamp_ns(record.cdr) if is_stamped else record.log_time_ns
            groups[record.name, stamp_ns].append(record)
    return groups


def _surplus(ours: Sequence[Record], theirs: Sequence[Record]) -> Iterator[tuple[str, str]]:
    if len(ours) > len(theirs):
        yield "", f"{len(ours) - len(theirs)} message(s) missing"
    if len(theirs) > len(ours):
        yield "", f"{len(theirs) - len(ours)} message(s) too many"


def _differences(ours: Sequence[Record], theirs: Sequence[Record], fit: Fit) -> Iterator[tuple[str, str]]:
    for a, b in zip(ours, theirs, strict=False):
        if a.cdr == b.cdr and a.type == b.type:
            continue
        if a.type != b.type:
            yield "", f"type {b.type}, {a.type} expected"
        else:
            yield from _first(_walk(decode(a), decode(b), "", fit))


def _first(differences: Iterator[tuple[str, str]]) -> list[tuple[str, str]]:
    first = next(differences, None)
    return [] if first is None else [first]


class Fit:
    """Looks a field's tolerance up, once per field."""

    def __init__(self, topic: str, tolerances: Sequence[Tolerance]) -> None:
        """Look up fields of an absolute topic."""
        self._topic = topic.removeprefix(f"{NAMESPACE}/")
        self._tolerances = tolerances
        self._known: dict[str, Tolerance] = {}

    def __call__(self, path: str) -> Tolerance:
        """Return the tolerance of a field given without indices, "sensors.innovation"."""
        if path not in self._known:
            name = f"{self._topic}.{path}"
            fits = (tolerance for tolerance in self._tolerances if fnmatchcase(name, tolerance.pattern))
            self._known[path] = next(fits, EXACT)
        return self._known[path]


def _walk(a: Any, b: Any, path: str, fit: Fit) -> Iterator[tuple[str, str]]:
    if is_dataclass(a):
        for item in fields(a):
            inner = f"{path}.{item.name}" if path else item.name
            yield from _walk(getattr(a, item.name), getattr(b, item.name), inner, fit)
    elif isinstance(a, list | np.ndarray):
        if len(a) != len(b):
            yield path, f"{len(b)} element(s), {len(a)} expected"
            return
        places: Iterable[int] = range(len(a))
        if isinstance(a, np.ndarray):  # of numbers
            places = np.flatnonzero(~_agreeing(a, b, fit(_without_indices(path)))).tolist()
        for i in places:
            yield from _walk(a[i], b[i], f"{path}[{i}]", fit)
    elif not _agree(a, b, fit(_without_indices(path))):
        yield path, f"{_text(b)}, {_text(a)} expected"


def _agreeing(a: NDArray[Any], b: NDArray[Any], tolerance: Tolerance) -> NDArray[np.bool_]:
    """Return which of some numbers agree, (k,); see ``_agree``."""
    if tolerance.atol == IGNORED:
        return np.ones(a.shape, dtype=bool)
    if not np.issubdtype(a.dtype, np.floating):
        return np.asarray(a == b)
    with np.errstate(invalid="ignore"):  # infinite ones
        is_close = abs(a.astype(float) - b) <= tolerance.atol + tolerance.rtol * abs(a.astype(float))
    same = (a == b) | (np.isnan(a) & np.isnan(b))
    return np.asarray(np.where(np.isfinite(a) & np.isfinite(b), is_close, same))


def _agree(a: Any, b: Any, tolerance: Tolerance) -> bool:
    if isinstance(a, str) or tolerance.atol == IGNORED:
        return tolerance.atol == IGNORED or a == b
    if isinstance(a, float | np.floating):
        if not (np.isfinite(a) and np.isfinite(b)):
            return bool(a == b or (np.isnan(a) and np.isnan(b)))
        return abs(float(a) - float(b)) <= tolerance.atol + tolerance.rtol * abs(float(a))
    return bool(a == b)


def _without_indices(path: str) -> str:
    return "".join(part.split("]")[-1] for part in path.split("["))


def _text(value: Any) -> str:
    return repr(value.item() if isinstance(value, np.generic) else value)
