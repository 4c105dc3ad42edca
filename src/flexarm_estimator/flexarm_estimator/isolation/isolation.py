r"""Which channel is at fault, and what is wrong with it: the past explained in many ways, the best wins.

Explanations are compared by ``-2 log`` of the likelihood of a whole window:

* all well, a flipped sign, two swapped channels: what was said is rearranged (``hypotheses``);
* detached: the channel says a constant with noise, whatever the arm does; the others are filtered without it;
* saturated: it repeats its largest value while the others expect more of it; the other samples are filtered;
* an offset that drifts: never a finding here, but an excuse;
* left out, wrong in some way: never a finding either, but another channel may be to blame.

A model that is wrong itself fits badly under every explanation: what is gained is divided by the misfit that
is left (sum of squared normalised innovations by number of data), and must be gained in both halves of the
window, which an impact or the beginning of a fault does not do.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

from flexarm_estimator.isolation.channels import Channels
from flexarm_estimator.isolation.consistency_run import ConsistencyRun
from flexarm_estimator.isolation.consistency_steps import survey
from flexarm_estimator.isolation.hypotheses import Hypotheses
from flexarm_estimator.isolation.window import Window

Array = NDArray[np.float64]
CLEAR = 60.0  # squared sigmas gained, after division by the misfit
SHARE = 0.25  # of it that each half must gain
ONE_HALF = 400.0  # squared sigmas that one half alone may show: no model error has been seen to
RIVAL = 20.0  # squared sigmas by which the best explanation of other channels must lose
RIVAL_SHARE = 0.05  # of what is gained, by which it must lose, too
PLAUSIBLE = 2.5  # misfit of a datum above which nothing is believed
QUIET = 3.0  # sigmas of noise that a detached channel may show
STUCK = 0.5  # share of values that repeat the one before, from which on a channel is frozen
AT_LIMIT = 5  # samples at the same largest value that make a saturation
SETTLING = 0.2  # of the window in which predictions are not compared


@dataclass(frozen=True)
class Explanation:
    """One way to explain the window.

    Attributes:
        channels: At fault.
        words: What is wrong with them; empty when this explanation only says that something is.
        gain: Squared sigmas gained on "all well" in each half, after division by the misfit left, (2,).
        spread: Misfit of a datum that is left, at least 1.
        needs_both: Both halves must gain; else the second, or one of them much, and the other must not lose.
        is_excuse: Nobody is at fault when this explains best.
    """

    channels: tuple[int, ...]
    words: str
    gain: Array
    spread: float
    needs_both: bool = True
    is_excuse: bool = False

    @property
    def total(self) -> float:
        """Squared sigmas gained in both halves together."""
        return float(self.gain.sum())

    @property
    def is_clear(self) -> bool:
        """It explains far more than "all well"."""
        first, second = self.gain
        enough, against = SHARE * CLEAR, -CLEAR / 2
        halves = first >= (enough if self.needs_both else against) and second >= enough
        if not self.needs_both and self.total >= ONE_HALF:  # in the other the arm may rest
            halves = min(first, second) >= against
        return bool(self.spread <= PLAUSIBLE and halves and self.total >= CLEAR)


def explain_by_rearranging(run: ConsistencyRun, hypotheses: Hypotheses) -> list[Explanation]:
    """Return what flipped signs and swaps explain; the first hypothesis is "all well"."""
    return [
        Explanation(hypothesis.channels, hypothesis.words, run.gains[:, i], run.spread(i))
        for i, hypothesis in enumerate(hypotheses.all)
        if i > 0
    ]


def explain_by_offset(channel: int, run: ConsistencyRun) -> Explanation:
    """Return what a drifting offset of a channel explains, which is another watch's matter."""
    excused = run.excused(channel)
    spread = max(1.0, run.spread(0) * float(excused.sum() / max(run.misfit[:, 0].sum(), 1e-300)))
    return Explanation((channel,), "", (run.misfit[:, 0] - excused) / spread, spread, is_excuse=True)


def explain_by_saturation(
    channel: int, run: ConsistencyRun, well: ConsistencyRun, window: Window, noise: float
) -> Explanation | None:
    """Return what it explains that a channel is saturated; None when the others expect no more of it.

    Args:
        channel: Left out where it is at its limit.
        run: Without these samples.
        well: With them.
        window: What was said.
        noise: Variance of a sample of the channel.
    """
    y, z, S = window.y[:, channel], run.predicted[:, channel], run.variance[:, channel]
    at_limit = samples_at_limit(y)
    at_limit[0] = False
    if at_limit.sum() < AT_LIMIT:
        return None
    low, high = np.nanmin(y), np.nanmax(y)  # ends of the range, of any sign; equal where it stays at one
    side = np.where(y == high, 1.0, -1.0) if low < high else np.sign(np.nansum(z - y)) or 1.0
    beyond = np.where(at_limit, (z - np.nan_to_num(y)) * side / np.sqrt(S), 0.0)
    if beyond[at_limit].mean() < 0.2:
        return None
    cost = np.where(at_limit, np.log(noise) - 2.0 * log_ndtr(beyond), 0.0)
    gain = (well.total(0) - run.total(0) - window.halves(cost)) / run.spread(0)
    limit = np.abs(y[at_limit]).max()
    return Explanation((channel,), f"is saturated at {limit:.3g}", gain, run.spread(0), needs_both=False)


def samples_at_limit(y: Array) -> NDArray[np.bool_]:
    """Return which samples repeat the largest or smallest value of the window exactly, (k,)."""
    found = np.zeros(y.shape, dtype=bool)
    if np.isfinite(y).any():
        for extreme in (np.nanmax(y), np.nanmin(y)):
            there = y == extreme
            if there.sum() >= AT_LIMIT:
                found |= there
    return found


def shortlist(run: ConsistencyRun, hypotheses: Hypotheses) -> list[int]:
    """Return the channels, those first that may be wrong: their sign does not matter, or they are far off."""
    sums = zip(hypotheses.all, run.misfit.sum(axis=0).tolist(), strict=True)
    flips = {one.channels[0]: misfit for one, misfit in sums if len(one.channels) == 1}
    by_sign = sorted(flips, key=lambda channel: flips[channel])
    by_misfit = sorted(flips, key=lambda channel: -float(run.marginal[channel]))
    found = list(hypotheses.all[int(np.argmin(run.misfit.sum(axis=0)))].channels)
    for pair in zip(by_sign, by_misfit, strict=True):
        found += [channel for channel in dict.fromkeys(pair) if channel not in found]
    return found


def decide(explanations: Sequence[Explanation]) -> Explanation | None:
    """Return the explanation to be told; None when nothing is clear or it may be another channel."""
    named = [e for e in explanations if e.words and e.is_clear]
    if not named:
        return None
    told = max(named, key=lambda explanation: explanation.total)
    rivals = [e.total for e in explanations if e.is_excuse or set(e.channels) != set(told.channels)]
    lead = max(RIVAL, RIVAL_SHARE * told.total)
    return told if told.total >= max(rivals, default=0.0) + lead else None


def say(channels: Channels, channel: int, explanation: Explanation) -> str:
    """Return what is said of one of the channels that an explanation blames."""
    own, others = channels.all[channel], [channels.all[i] for i in explanation.channels if i != channel]
    is_whole = len(others) > 1
    names = [other.sensor if is_whole else f"{other.sensor} {other.name}".strip() for other in others]
    partner = " ".join(dict.fromkeys(name for name in names if not is_whole or name != own.sensor))
    words = explanation.words.format(partner)
    said = f"{words} ({explanation.total:.0f} squared sigmas better explained than by a sound sensor)"
    return f"{own.name}: {said}" if own.name and not is_whole else said


def leave_out_useless(y: Array, ignored: NDArray[np.bool_], use_compiler: bool = True) -> list[int]:
    """Ignore in place what was not said, and channels that mostly repeat their last value exactly.

    These are frozen, another watch's matter.

    Args:
        y: What they said, NaN where nothing, (k, m); contiguous, as the other.
        ignored: What is left out, (k, m).
        use_compiler: False computes with NumPy instead of machine code: the same, slower.

    Returns:
        Channels of which something is left.
    """
    most = STUCK * len(y)
    heard = survey(y, ignored, most) if use_compiler else None
    if heard is None:
        ignored |= np.isnan(y) | ((np.diff(y, axis=0) == 0.0).sum(axis=0) > most)
        heard = np.flatnonzero(~ignored.all(axis=0)).tolist()
    return heard


def is_silent(y: Array, noise: float) -> bool:
    """Return whether a channel says no more than noise, little or white, which a moving arm is not.

    Args:
        y: What it said, NaN where nothing, (k,).
        noise: Variance of a sample.
    """
    y = y[np.isfinite(y)]
    if y.size < AT_LIMIT:
        return False
    y = y - y.mean()
    square = float(y.dot(y))
    return bool(square <= QUIET**2 * noise * y.size or abs(float(y[1:].dot(y[:-1]))) <= 0.5 * square)


def share_said(y: Array, z: Array) -> float:
    """Return the variance of what a channel said, (k,), over that of what was predicted for it, z (k,)."""
    settled = np.isfinite(y) & (np.arange(len(y)) >= SETTLING * len(y))
    return float(y[settled].var() / max(z[settled].var(), 1e-300)) if settled.any() else np.inf
