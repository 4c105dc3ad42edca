"""What ticks leave behind, and the window that it makes: stamp by stamp, a few samples at a time."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Generator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.isolation.channels import Channels
from flexarm_estimator.isolation.known_biases import known_biases, told_biases
from flexarm_estimator.isolation.window import Window
from flexarm_estimator.measurement import SAME_INSTANT, Measurement
from flexarm_estimator.parts import Parts
from flexarm_estimator.watches.watch import View

Array = NDArray[np.float64]
_AT_A_TIME = 20  # samples that are read in one piece


class Entry(NamedTuple):
    """What one tick leaves behind.

    Attributes:
        t: [s].
        u: [tau; 1] held until then, (n_u + 1,).
        theta: Axes as estimated [rad] or [m], (n_theta,).
        biases: Mean and variance of the sensors' biases, (2, n_b).
        learned: Parameters of the model as learned, (n_p,).
        samples: Of all sensors.
        parts: Model in use.
    """

    t: float
    u: Array
    theta: Array
    biases: Array
    learned: tuple[float, ...]
    samples: Sequence[Measurement]
    parts: Parts


def entry_of(view: View, parts: Parts, learned: tuple[float, ...], samples: Sequence[Measurement]) -> Entry:
    """Return what a tick leaves behind: ``learned`` (n_p,) of the model, and the samples that count."""
    theta = view.belief.x[parts.layout.theta].copy()
    return Entry(view.t, view.u, theta, told_biases(view.belief, parts), learned, samples, parts)


def read_window(
    channels: Channels, entries: deque[Entry], pace: int = 1
) -> Generator[None, None, Window | None]:
    """Return what the channels said, stamp by stamp; None when it is too little.

    Args:
        channels: All of them.
        entries: Of the window; used up.
        pace: How many times as much is done in a piece.
    """
    t, u, parts = [-math.inf], list[Array](), list[Parts]()
    y, taken, count, entry = channels.silence(len(entries)), 0, len(entries), entries[0]
    start = entry
    while entries:  # letting go of all at once in the end would take longer than a piece
        entry = entries.popleft()
        for sensor, stamp, said, _ in entry.samples:
            span = channels.spans.get(sensor)
            if span is None or stamp < t[-1] - SAME_INSTANT:  # an older one came too late for this
                continue
            if stamp > t[-1] + SAME_INSTANT:
                if len(u) == len(y):
                    y = np.concatenate([y, channels.silence(len(y))])
                t.append(stamp)
                u.append(entry.u)
                parts.append(entry.parts)
            y[len(u) - 1, span] = said
        taken += len(entry.samples)
        if taken >= pace * _AT_A_TIME:
            taken = 0
            yield
    yield
    if len(u) < count // 2:
        return None
    biases = known_biases(start.biases, start.parts, channels)
    return Window(np.array(t[1:]), u, y[: len(u)], parts, start.theta, entry.learned, biases)
