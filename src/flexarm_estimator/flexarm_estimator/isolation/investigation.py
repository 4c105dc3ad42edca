"""An investigation of the recent past, in pieces small enough for a control loop.

A generator yields after each piece of work; what it returns at the end is the explanation to be told, if any.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Generator, Sequence

import numpy as np

from flexarm_estimator.isolation.case import Case, Mask, excess_of, fit_noise, run_over
from flexarm_estimator.isolation.consistency_run import ConsistencyRun
from flexarm_estimator.isolation.cross_check import is_borne_out
from flexarm_estimator.isolation.hypotheses import Hypotheses, rearrangements
from flexarm_estimator.isolation.isolation import (
    CLEAR,
    Explanation,
    decide,
    explain_by_offset,
    explain_by_rearranging,
    explain_by_saturation,
    is_silent,
    leave_out_useless,
    samples_at_limit,
    share_said,
    shortlist,
)
from flexarm_estimator.isolation.leaving_out import (
    are_loud,
    explain_by_leaving_out,
    in_another_way,
    speak_again,
)
from flexarm_estimator.isolation.window import Window
from flexarm_estimator.isolation.window_reading import Entry, read_window

_UNREMARKABLE = 1.2  # mean squared normalised innovation of any row up to which nothing is looked for
_STRIKING = 1.5  # the same, from which on a close look is urgent
_WELL_EXPLAINED = 1.2  # misfit of a datum that leaves nothing to be explained
_OVERWHELMING = 3.0 * CLEAR  # squared sigmas gained that need no comparison with silent channels
_MOST = 3  # silent channels that are left out in turn, beside the one that says least of what it should
_RIVALS = 2  # others that are left out when something stays unexplained

Investigation = Generator[None, None, Explanation | None]


def investigate(case: Case, entries: deque[Entry]) -> Investigation:
    """Look for a channel at fault among those that are not known to be."""
    window = yield from read_window(case.channels, entries, case.pace)
    if window is None:
        return None
    ignored = np.zeros(window.y.shape, dtype=bool)
    if case.faulty:
        ignored[:, list(case.faulty)] = True
    heard = leave_out_useless(window.y, ignored)
    if not heard:  # all stand still: frozen, or without noise; none can be told wrong by another
        return None
    hypotheses = rearrangements(case.channels, frozenset(heard))
    yield
    well = yield from _look(case, window, ignored, hypotheses)
    return None if well is None else (yield from _explain(case, window, ignored, hypotheses, well))


def reconsider(case: Case, entries: deque[Entry], told: Explanation) -> Investigation:
    """Return what was told if it no longer holds: all being well explains far more than any fault of it.

    What was called detached is heard again as soon as it says what the others predict, or half as much,
    however badly the model fits.
    """
    window = yield from read_window(case.channels, entries, case.pace)
    if window is None:
        return None
    ignored = np.isnan(window.y)
    ignored[:, list(case.faulty - set(told.channels))] = True
    if ignored[:, list(told.channels)].any():
        return None
    yield
    if speak_again(told, window, case.floor(window)):
        without = ignored.copy()
        without[:, told.channels] = True
        others = yield from run_over(case, window, without, case.all_well)
        if are_loud(told.channels, window, others):
            return told
        yield
    every = rearrangements(case.channels, case.channels.everybody)
    about = every.about(told.channels)
    well = yield from run_over(case, window, ignored, about)
    explanations = explain_by_rearranging(well, about)
    told_channels = [(channel,) for channel in told.channels]
    explanations += yield from _leave_out(case, window, ignored, well, about, told_channels)
    is_well = _is_fitted(case, window, ignored, well) and all(
        (explanation.gain <= -CLEAR / 2).all() for explanation in explanations
    )
    return told if is_well else None


def _look(
    case: Case, window: Window, ignored: Mask, hypotheses: Hypotheses
) -> Generator[None, None, ConsistencyRun | None]:
    """Return the run of all hypotheses and offsets; None when nothing is remarkable.

    Without a suspicion a first look does without offsets, which are half of the work.
    """
    if case.is_close or not case.is_urgent:
        look = fit_noise if case.is_close else run_over
        first = yield from look(case, window, ignored, hypotheses)
        if not _is_remarkable(case, window, ignored, first):
            return None
        marginal, gain = first.extremes
        case.is_urgent |= not case.is_close or marginal >= _STRIKING or gain >= CLEAR / 2
    well = yield from run_over(case, window, ignored, hypotheses, case.offsets)
    return well if _is_remarkable(case, window, ignored, well) else None


def _explain(
    case: Case, window: Window, ignored: Mask, hypotheses: Hypotheses, well: ConsistencyRun
) -> Investigation:
    """Return the explanation to be told of a window in which something is remarkable."""
    heard = [one.channels[0] for one in hypotheses.all if len(one.channels) == 1]
    explanations = explain_by_rearranging(well, hypotheses)
    for channel in heard:
        yield
        explanations.append(explain_by_offset(channel, well))
    yield
    told = decide(explanations)
    if told is not None and told.spread <= _WELL_EXPLAINED and told.gain.sum() >= _OVERWHELMING:
        return (yield from _cross_check(case, window, ignored, hypotheses, told))
    noise = case.floor(window)
    order = shortlist(well, hypotheses)
    silent = [channel for channel in order if is_silent(window.y[:, channel], noise[channel])]
    candidates = silent[:_MOST]
    if told is not None:  # whom it would blame may be sound
        shares = {channel: share_said(window.y[:, channel], well.predicted[:, channel]) for channel in silent}
        candidates += [c for c in sorted(silent, key=shares.__getitem__)[:1] if c not in candidates]
    if told is not None and told.spread > _WELL_EXPLAINED:
        candidates += [channel for channel in order[:_RIVALS] if channel not in candidates]
    whole = [places for places in case.channels.wide if set(places) <= set(heard)]
    mute = [places for places in whole if all(is_silent(window.y[:, i], noise[i]) for i in places)]
    left_out = [(channel,) for channel in candidates] + mute
    explanations += yield from _leave_out(case, window, ignored, well, hypotheses, left_out)
    explanations += yield from _saturate(case, window, ignored, well, heard)
    told = decide(explanations)
    return None if told is None else (yield from _cross_check(case, window, ignored, hypotheses, told))


def _cross_check(
    case: Case, window: Window, ignored: Mask, hypotheses: Hypotheses, told: Explanation
) -> Investigation:
    """Return what is to be told; None for a rearrangement that the other channels do not see."""
    for blamed in hypotheses.all:
        if blamed.words == told.words and blamed.channels == told.channels:
            without = ignored.copy()
            without[:, told.channels] = True
            run = yield from run_over(case, window, without, case.all_well)
            return told if is_borne_out(blamed, run, window) else None
    return told


def _is_remarkable(case: Case, window: Window, ignored: Mask, well: ConsistencyRun) -> bool:
    """Return whether there is something to explain that could be."""
    marginal, gain = well.extremes
    is_much = marginal >= _UNREMARKABLE or gain >= CLEAR / 2
    return is_much and _is_fitted(case, window, ignored, well)


def _is_fitted(case: Case, window: Window, ignored: Mask, well: ConsistencyRun) -> bool:
    """Return whether a run is sound and its process noise enough: offsets lead to other tangents."""
    return well.is_sound and (case.share == 1.0 or excess_of(well, window, ignored) <= 1.0)


def _leave_out(
    case: Case,
    window: Window,
    ignored: Mask,
    well: ConsistencyRun,
    hypotheses: Hypotheses,
    candidates: Sequence[tuple[int, ...]],
) -> Generator[None, None, list[Explanation]]:
    found = []
    for channels in candidates:
        without = ignored.copy()
        without[:, channels] = True
        run = yield from run_over(case, window, without, case.all_well)
        about = [
            i for i, one in enumerate(hypotheses.all) if not i or not set(channels).isdisjoint(one.channels)
        ]
        fits = [well.misfit[:, i] for i in about]
        fit = min([*fits, well.least], key=lambda misfit: float(misfit.sum()))
        can_float = all(case.channels.all[channel].can_float for channel in channels)
        explanation = explain_by_leaving_out(channels, run, well, fit, window, case.floor(window))
        found.append(explanation if can_float else in_another_way(explanation))
    return found


def _saturate(
    case: Case, window: Window, ignored: Mask, well: ConsistencyRun, candidates: Sequence[int]
) -> Generator[None, None, list[Explanation]]:
    found = []
    for channel in candidates:
        at_limit = samples_at_limit(window.y[:, channel])
        yield
        if not at_limit.any():
            continue
        without = ignored.copy()
        without[at_limit, channel] = True
        run = yield from run_over(case, window, without, case.all_well)
        noise = case.floor(window)[channel]
        explanation = explain_by_saturation(channel, run, well, window, noise)
        found += [explanation] if explanation else []
    return found
