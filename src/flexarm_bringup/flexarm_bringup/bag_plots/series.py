"""The messages of a bag as series over time.

Time is that of the headers, from the first message of the run on [s]; that of arrival where there is none, or
a stamp of zero: who has not heard the run's clock yet has no other. Lines of many points are thinned to the
extremes of short stretches, so that no peak is lost and a page stays small.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from operator import attrgetter
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.bag_plots.silence import gaps, usual_step
from flexarm_bringup.bags.bag_reader import Bag, decode, stamp_of
from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.bags.cdr import NS_PER_S
from flexarm_bringup.bags.configuration import configuration
from flexarm_bringup.topics import NAMESPACE
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.settings.strict_yaml import ConfigError

Array = NDArray[np.float64]
STRETCHES = 800  # of a line; two points are kept of each
ZERO_TOPICS = ("modal_state", "joint_states")  # the first stamp of the first of them is time zero
NEAR_ZERO_NS = NS_PER_S  # a run that begins before this counts from zero: there a stamp of zero is a time


class Arrived(NamedTuple):
    """A message, when it came [ns], and its stamp [ns]; 0 without a header."""

    msg: Any
    log_time_ns: int
    stamp_ns: int


class BagSeries:
    """The topics of one bag.

    Attributes:
        bag: The bag.
        path: Folder of the bag, as given.
        counts: Messages by absolute topic.
    """

    def __init__(self, bag: Bag) -> None:
        """Look at a bag that is whole."""
        self.bag = self._bag = bag
        self._decoded = dict[str, list[Arrived]]()
        self.path, self.counts = bag.path, bag.counts

    def has(self, topic: str) -> bool:
        """Tell whether the bag has messages of a relative topic; "imu/*" stands for any of a family."""
        return bool(self.topics(topic))

    def topics(self, topic: str) -> list[str]:
        """Return the absolute topics with messages that a relative topic or a family stands for."""
        name = topic if topic.startswith("/") else f"{NAMESPACE}/{topic}"
        if name.endswith("*"):
            return sorted(t for t, count in self.counts.items() if count and t.startswith(name[:-1]))
        return [name] if self.counts.get(name) else []

    def messages(self, topic: str) -> list[Any]:
        """Return the messages of a relative or absolute topic, in order of their times; maybe none."""
        return [arrived.msg for arrived in sorted(self._arrived(topic), key=self._instant_ns)]

    def times(self, topic: str) -> Array:
        """Return the times of a topic's messages from time zero on [s], (k,)."""
        instants = sorted(self._instant_ns(arrived) for arrived in self._arrived(topic))
        return np.array([(instant - self._zero.stamp_ns) / NS_PER_S for instant in instants])

    def column(self, topic: str, value: Callable[[Any], Any]) -> Array:
        """Return a number or a vector of every message, (k, ...); vectors of other lengths become NaN."""
        rows = [np.asarray(value(msg), float) for msg in self.messages(topic)]
        shape = max((row.shape for row in rows), default=())
        return np.array([row if row.shape == shape else np.full(shape, np.nan) for row in rows])

    @cached_property
    def end(self) -> float:
        """Last stamp of what the run lives on [s]."""
        return max((float(self.times(t)[-1]) for t in ZERO_TOPICS if self.has(t)), default=np.inf)

    @cached_property
    def config(self) -> ManipulatorConfig | None:
        """The manipulator that the bag was recorded with; None where it does not say."""
        try:
            return configuration(self._bag)[0]
        except (BagError, ConfigError):
            return None

    def _arrived(self, topic: str) -> list[Arrived]:
        (name, *_) = self.topics(topic) or [topic]
        if name not in self._decoded:
            records = [record for record in self._bag.records if record.name == name]
            found = [(decode(record), record.log_time_ns) for record in records]
            self._decoded[name] = [
                Arrived(msg, log_ns, stamp_of(msg) if hasattr(msg, "header") else 0) for msg, log_ns in found
            ]
        return self._decoded[name]

    def _instant_ns(self, arrived: Arrived) -> int:
        """Return the time of a message by the clock of the stamps [ns]."""
        counts_from_zero = self._zero.stamp_ns < NEAR_ZERO_NS and hasattr(arrived.msg, "header")
        if arrived.stamp_ns or counts_from_zero:
            return arrived.stamp_ns
        return arrived.log_time_ns + self._zero.stamp_ns - self._zero.log_time_ns

    @cached_property
    def _zero(self) -> Arrived:
        """The message that is time zero."""
        for topic in ZERO_TOPICS:
            found = sorted(self._arrived(topic), key=attrgetter("stamp_ns"))
            stamped = [arrived for arrived in found if arrived.stamp_ns]
            if stamped:
                return found[0] if stamped[0].stamp_ns < NEAR_ZERO_NS else stamped[0]
        first = min(record.log_time_ns for record in self._bag.records)
        return Arrived(None, first, first)


def thin(t: Array, y: Array) -> tuple[Array, Array]:
    """Return the extremes of a line in short stretches, in order of time; short lines as they are.

    Of a stretch with gaps the extremes of its numbers are kept; one without a number stays a gap.

    Args:
        t: Instants [s], (k,).
        y: The line; NaN where there is none, (k,).
    """
    if t.size <= 4 * STRETCHES:
        return t, y
    edges = np.linspace(0, t.size, STRETCHES + 1).astype(int)
    kept: list[int] = []
    for low, high in zip(edges[:-1], edges[1:], strict=True):
        known = low + np.flatnonzero(np.isfinite(y[low:high]))
        at = known if known.size else np.array([low])
        kept += sorted({int(at[y[at].argmin()]), int(at[y[at].argmax()])})
    return t[kept], y[kept]


def spells(t: Array, values: Sequence[Any], holds: bool = False) -> list[tuple[float, float, Any]]:
    """Return from when to when [s] a value that jumps stayed the same: (start, length, value) each.

    Args:
        t: Instants of the messages, sorted [s], (k,).
        values: What they say, k.
        holds: Whether what was said holds until the next message, however late; else a spell ends a step
            after the last message before a silence.
    """
    found: list[tuple[float, float, Any]] = []
    step, is_last = usual_step(t), np.zeros(t.size, bool) if holds else gaps(t)
    ends = np.where(is_last, t + step, np.append(t[1:], t[-1:] + step))
    for i, value in enumerate(values):
        if found and found[-1][2] == value and not is_last[i - 1]:
            found[-1] = (found[-1][0], float(ends[i]) - found[-1][0], value)
        else:
            found.append((float(t[i]), float(ends[i] - t[i]), value))
    return found


def constant_names(msg: Any, among: Sequence[str] = ()) -> Mapping[int, str]:
    """Return the names of a message's constants by value, "MPC" as "mpc"."""
    names = {n: getattr(type(msg), n) for n in dir(type(msg)) if n.isupper() and (not among or n in among)}
    return {int(value): name.lower().replace("_", " ") for name, value in names.items()}
