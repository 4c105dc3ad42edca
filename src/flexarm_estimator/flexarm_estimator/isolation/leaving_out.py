"""A channel, or all of a sensor, left out: do they say anything of the arm?"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.isolation.consistency_run import ConsistencyRun
from flexarm_estimator.isolation.isolation import AT_LIMIT, SETTLING, Explanation, is_silent, share_said
from flexarm_estimator.isolation.window import Window

Array = NDArray[np.float64]
DETACHED_WORDS = "is detached"  # how what is told of it begins
DETACHED = 120.0  # squared sigmas that calling a channel detached must gain; silence alone is suggestive
EXPLAINED = 1.5  # misfit of a datum up to which a silent channel may be called detached
MOSTLY = 4.0  # times the misfit that is left is gone without it: up to PLAUSIBLE that is as good
EXCITED = 3.0  # times what a detached channel says the others must predict for it
AUDIBLE = 1.5  # times its noise, too
LOST = 30.0  # sigmas of the others' prediction in what changes of it, up to which they know the channel
FAINT = 0.25  # variance over that of what the others predict, below which a channel is not well again
FOLLOWS = 0.5  # correlation with what the others predict, from which on a channel is not detached


def explain_by_leaving_out(
    channels: tuple[int, ...],
    run: ConsistencyRun,
    well: ConsistencyRun,
    fit: Array,
    window: Window,
    noise: Array,
) -> Explanation:
    """Return what it explains that channels of one sensor are detached, or wrong in another way.

    Args:
        channels: Left out in all steps.
        run: Without them.
        well: With them.
        fit: Least misfit that these channels being in use can have in both halves, (2,).
        window: What was said.
        noise: Variance that a sample of every channel has at least, (m,).
    """
    spread, least = run.spread(0), noise[list(channels)].tolist()
    others = [(run.predicted[:, i], run.variance[:, i]) for i in channels]
    own = [_own_story(window.y[:, i], *said, q) for i, said, q in zip(channels, others, least, strict=True)]
    cost, count = np.zeros(2), np.zeros(2)
    for story in own:
        cost += window.halves(story.cost)
        count += window.halves(story.heard)
    told = (well.total(0) - run.total(0) - cost) / spread
    missed = (fit - run.misfit[:, 0]) / spread - count  # a tight guess alone is no proof
    is_explained = spread <= EXPLAINED or MOSTLY * spread <= well.spread(0)  # never beyond PLAUSIBLE
    is_detached = is_explained and all(story.is_alone for story in own)
    is_detached &= any(story.is_missed for story in own)
    gain = np.minimum(told, missed)
    says = ", ".join(story.words for story in own)
    words = f"is detached (says {says} whatever the arm does)"
    is_detached &= bool(gain.sum() >= DETACHED)
    return Explanation(channels, words if is_detached else "", gain, spread, needs_both=not is_detached)


def in_another_way(explanation: Explanation) -> Explanation:
    """Return what is left of an explanation where channels cannot be detached: they are wrong somehow."""
    return replace(explanation, words="", needs_both=True)


def speak_again(told: Explanation, window: Window, noise: Array) -> bool:
    """Return whether channels that were called detached say more than noise, which no channel does that is.

    Args:
        told: What was told of them, or of others something else.
        window: What was said since.
        noise: Variance that a sample of every channel has at least, (m,).
    """
    is_detached = told.words.startswith(DETACHED_WORDS)
    return is_detached and not any(is_silent(window.y[:, i], noise[i]) for i in told.channels)


def are_loud(channels: tuple[int, ...], window: Window, run: ConsistencyRun) -> bool:
    """Return whether channels say at least half of what the others predict; less has another unit, or hangs.

    Args:
        channels: Which.
        window: What was said.
        run: Without them.
    """
    return all(share_said(window.y[:, i], run.predicted[:, i]) >= FAINT for i in channels)


class _Story(NamedTuple):
    """A channel that has nothing to do with the arm: what that costs and where it spoke, (k,)."""

    cost: Array
    heard: Array
    is_alone: bool
    is_missed: bool  # it should have said much more
    words: str


def _own_story(y: Array, z: Array, S: Array, noise: float) -> _Story:
    """Return a channel that said y as a constant with noise, the others predicting z +- sqrt(S), (k,)."""
    heard: NDArray[np.bool_] = np.isfinite(y)
    heard[0] = False
    y0, variance = np.nanmean(y), float(np.nanvar(y))
    square = max(variance, noise)
    cost = np.where(heard, (np.nan_to_num(y) - y0) ** 2 / square + np.log(square), 0.0)
    settled = heard & (np.arange(len(y)) >= SETTLING * len(y))
    follows = variance > noise and _follows(y[settled], z[settled])  # else too faintly to matter
    expected = float(z[settled].var()) if settled.any() else 0.0
    is_heard = expected >= max(EXCITED**2 * variance, AUDIBLE**2 * noise)
    is_missed = is_heard and expected * LOST**2 >= float(S[settled].mean())
    words = f"{y0:.3g} +- {np.sqrt(variance):.1g}"
    return _Story(cost, heard.astype(np.float64), is_silent(y, noise) and not follows, is_missed, words)


def _follows(y: Array, z: Array) -> bool:
    """Return whether a channel shows what the others predict for it."""
    if y.size < AT_LIMIT:
        return True
    y, z = y - y.mean(), z - z.mean()
    return bool(abs(y.dot(z)) > FOLLOWS * np.sqrt(y.dot(y) * z.dot(z)))
