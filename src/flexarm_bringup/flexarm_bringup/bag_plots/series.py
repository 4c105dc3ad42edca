"""The messages of a bag as series over time.

Time is that of the headers, from the first message of the run on [s]. Lines of many points are thinned to the
extremes of short stretches, so that no peak is lost and a page stays small.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
        self._decoded = dict[str, list[Any]]()
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
        """Return the messages of a relative or absolute topic, in order of their stamps; maybe none."""
        (name, *_) = self.topics(topic) or [topic]
        if name not in self._decoded:
            found = [decode(record) for record in self._bag.records if record.name == name]
            if found and hasattr(found[0], "header"):
                found.sort(key=stamp_of)
            self._decoded[name] = found
        return self._decoded[name]

    def times(self, topic: str) -> Array:
        """Return the stamps of a topic's messages from time zero on [s], (k,); by arrival without stamps."""
        found = self.messages(topic)
        if found and hasattr(found[0], "header"):
            stamps = [stamp_of(msg) for msg in found]
        else:
            name = (self.topics(topic) or [topic])[0]
            stamps = [r.log_time_ns for r in self._bag.records if r.name == name]
        return np.array([(stamp - self._zero_ns) / NS_PER_S for stamp in stamps])

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

    @cached_property
    def _zero_ns(self) -> int:
        for topic in ZERO_TOPICS:
            if self.has(topic):
                return stamp_of(self.messages(topic)[0])
        return min(record.log_time_ns for record in self._bag.records)


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


def spells(t: Array, values: Sequence[Any]) -> list[tuple[float, float, Any]]:
    """Return from when to when [s] a value that jumps stayed the same: (start, length, value) each."""
    found: list[tuple[float, float, Any]] = []
    step = float(np.median(np.diff(t))) if t.size > 1 else 0.0
    for i, value in enumerate(values):
        end = float(t[i + 1]) if i + 1 < t.size else float(t[i]) + step
        if found and found[-1][2] == value:
            found[-1] = (found[-1][0], end - found[-1][0], value)
        else:
            found.append((float(t[i]), end - float(t[i]), value))
    return found


def constant_names(msg: Any, among: Sequence[str] = ()) -> Mapping[int, str]:
    """Return the names of a message's constants by value, "MPC" as "mpc"."""
    names = {n: getattr(type(msg), n) for n in dir(type(msg)) if n.isupper() and (not among or n in among)}
    return {int(value): name.lower().replace("_", " ") for name, value in names.items()}
