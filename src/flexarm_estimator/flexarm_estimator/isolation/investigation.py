"""An investigation of the recent past, in pieces small enough for a control loop.

A generator yields after each piece of work; what it returns at the end is the explanation to be told, if any.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.history import SAME_INSTANT
from flexarm_estimator.isolation.channels import Channels
from flexarm_estimator.isolation.consistency_run import ConsistencyRun
from flexarm_estimator.isolation.hypotheses import Rearrangement, rearrangements, undo
from flexarm_estimator.isolation.isolation import (
    CLEAR,
    Explanation,
    decide,
    explain_by_leaving_out,
    explain_by_offset,
    explain_by_rearranging,
    explain_by_saturation,
    is_silent,
    is_stuck,
    samples_at_limit,
    shortlist,
)
from flexarm_estimator.isolation.window import StepMaker, Window
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.parts import Parts

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
_ENTRIES = 10  # of the ring that are read in one piece
_AT_A_TIME = 30  # rows of data that are put together in one piece
_WORK = 9000.0  # numbers that one piece may move, about
_OVERHEAD = 600.0  # numbers that could be moved while a step is set up
_UNREMARKABLE = 1.2  # mean squared normalised innovation of any row up to which nothing is looked for
_WELL_EXPLAINED = 1.2  # misfit of a datum that leaves nothing to be explained
_OFFSET = 5.0, 1.0  # sigmas of noise: offset, and half of its change over the window, of a sound channel
_OVERWHELMING = 3.0 * CLEAR  # squared sigmas gained that need no comparison with silent channels
_MOST = 2  # silent channels that are left out in turn
_RIVALS = 2  # others that are left out when something stays unexplained
_AT_ONCE = 2  # offsets that are looked for in one piece


class Entry(NamedTuple):
    """What one tick leaves behind.

    Attributes:
        t: [s].
        u: [tau; 1] held until then, (n_u + 1,).
        theta: Axes as estimated [rad] or [m], (n_theta,).
        learned: Parameters of the model as learned, (n_p,).
        samples: Of all sensors.
        parts: Model in use.
    """

    t: float
    u: Array
    theta: Array
    learned: tuple[float, ...]
    samples: Sequence[Measurement]
    parts: Parts


@dataclass(frozen=True)
class Case:
    """What is investigated.

    Attributes:
        channels: All channels.
        convicted: Channels that are known to be at fault.
        maker: Of joint steps, kept between investigations.
        haste: Times the usual work in one piece; more than 1 where somebody is suspected.
    """

    channels: Channels
    convicted: frozenset[int]
    maker: StepMaker
    haste: float = 1.0

    @property
    def offsets(self) -> Array:
        """One sigma of a constant and of a ramp that are not worth a conviction, (m, 2)."""
        return np.outer(self.channels.sigma, _OFFSET)

    def floor(self, window: Window) -> Array:
        """Return the variance of every row with the force noise it feels, (m,)."""
        return self.maker.step(window.parts[-1], window.t[-1] - window.t[-2]).floor


Investigation = Generator[None, None, Explanation | None]


def investigate(case: Case, entries: Sequence[Entry]) -> Investigation:
    """Look for a channel at fault among those that are not convicted."""
    window = yield from read_window(case.channels, entries)
    if window is None:
        return None
    yield
    ignored = np.isnan(window.y)
    ignored[:, list(case.convicted)] = True
    ignored[:, is_stuck(window.y)] = True
    heard = [i for i in range(len(case.channels.all)) if not ignored[:, i].all()]
    if not heard:  # all stand still: frozen, or without noise; nobody can be accused by another
        return None
    hypotheses = rearrangements(case.channels, heard)
    yield
    well = yield from _run(case, window, ignored, hypotheses, case.offsets)
    yield
    explanations = explain_by_rearranging(well, hypotheses)
    if not well.is_sound or (
        well.marginal.max() < _UNREMARKABLE and max(float(e.gain.sum()) for e in explanations) < CLEAR / 2
    ):
        return None
    yield
    for i, channel in enumerate(heard):
        explanations.append(explain_by_offset(channel, well))
        if i % _AT_ONCE == _AT_ONCE - 1:
            yield
    told = decide(explanations)
    if told is not None and told.spread <= _WELL_EXPLAINED and told.gain.sum() >= _OVERWHELMING:
        return told
    noise = case.floor(window)
    order = shortlist(well, hypotheses)
    candidates = [channel for channel in order if is_silent(window.y[:, channel], noise[channel])][:_MOST]
    if told is not None and told.spread > _WELL_EXPLAINED:
        candidates += [channel for channel in order[:_RIVALS] if channel not in candidates]
    explanations += yield from _leave_out(case, window, ignored, well, hypotheses, candidates)
    explanations += yield from _saturate(case, window, ignored, well, heard)
    return decide(explanations)


def reconsider(case: Case, entries: Sequence[Entry], told: Explanation) -> Investigation:
    """Return a conviction if it no longer holds: all being well explains far more than any fault of it."""
    window = yield from read_window(case.channels, entries)
    if window is None:
        return None
    ignored = np.isnan(window.y)
    ignored[:, list(case.convicted - set(told.channels))] = True
    if ignored[:, list(told.channels)].any():
        return None
    every = rearrangements(case.channels, range(len(case.channels.all)))
    about = every[:1] + [h for h in every[1:] if set(h.channels) <= set(told.channels)]
    well = yield from _run(case, window, ignored, about)
    explanations = explain_by_rearranging(well, about)
    explanations += yield from _leave_out(case, window, ignored, well, about, told.channels)
    is_well = well.is_sound and all((explanation.gain <= -CLEAR / 2).all() for explanation in explanations)
    return told if is_well else None


def read_window(channels: Channels, entries: Sequence[Entry]) -> Generator[None, None, Window | None]:
    """Return what the channels said, stamp by stamp; None when it is too little."""
    rows = yield from _gather(channels, entries)
    if len(rows) < len(entries) // 2:
        return None
    y = []
    for first in range(0, len(rows), _AT_A_TIME):
        y += [channels.read(row[3]) for row in rows[first : first + _AT_A_TIME]]
        yield
    return Window(
        np.array([row[0] for row in rows]), np.array([row[1] for row in rows]), np.array(y),
        [row[2] for row in rows], entries[0].theta, entries[-1].learned,
    )  # fmt: skip


Row = tuple[float, Array, Parts, dict[str, Measurement]]


def _gather(channels: Channels, entries: Sequence[Entry]) -> Generator[None, None, list[Row]]:
    """Return stamp, inputs, model and samples of every instant."""
    rows: list[Row] = []
    for i, entry in enumerate(entries):
        for sample in entry.samples:
            if sample.sensor not in channels.spans:
                continue
            if not rows or sample.t > rows[-1][0] + SAME_INSTANT:
                rows.append((sample.t, entry.u, entry.parts, {}))
            if abs(sample.t - rows[-1][0]) <= SAME_INSTANT:  # an older one came too late for this
                rows[-1][3][sample.sensor] = sample
        if i % _ENTRIES == 0:
            yield
    return rows


def _run(
    case: Case,
    window: Window,
    ignored: Mask,
    hypotheses: Sequence[Rearrangement],
    offsets: Array | None = None,
) -> Generator[None, None, ConsistencyRun]:
    Y = undo(hypotheses, np.nan_to_num(window.y))
    yield
    run = ConsistencyRun(window, Y, case.maker, ignored, offsets)
    size = window.parts[0].layout.n_x + window.y.shape[1]
    columns = Y.shape[2] + (0 if offsets is None else 2 * Y.shape[1])
    steps = max(1, int(case.haste * _WORK / (_OVERHEAD + size**2 + size * columns / 2)))
    while not run.is_done:
        run.advance(steps)
        yield
    return run


def _leave_out(
    case: Case,
    window: Window,
    ignored: Mask,
    well: ConsistencyRun,
    hypotheses: Sequence[Rearrangement],
    candidates: Sequence[int],
) -> Generator[None, None, list[Explanation]]:
    found = []
    for channel in candidates:
        without = ignored.copy()
        without[:, channel] = True
        run = yield from _run(case, window, without, rearrangements(case.channels, ()))
        about = [i for i, hypothesis in enumerate(hypotheses) if not i or channel in hypothesis.channels]
        fits = [well.misfit[:, i] for i in about]
        fit = min([*fits, well.least], key=lambda misfit: float(misfit.sum()))
        noise = case.floor(window)[channel]
        found.append(explain_by_leaving_out(channel, run, well, fit, window, noise))
    return found


def _saturate(
    case: Case, window: Window, ignored: Mask, well: ConsistencyRun, candidates: Sequence[int]
) -> Generator[None, None, list[Explanation]]:
    found = []
    for channel in candidates:
        at_limit = samples_at_limit(window.y[:, channel])
        if not at_limit.any():
            continue
        without = ignored.copy()
        without[at_limit, channel] = True
        run = yield from _run(case, window, without, rearrangements(case.channels, ()))
        noise = case.floor(window)[channel]
        explanation = explain_by_saturation(channel, run, well, window, noise)
        found += [explanation] if explanation else []
    return found
