"""What is investigated, and runs of the filter over it in pieces small enough for a control loop.

The settings of a filter bear the fastest motion of the worst arm: on most windows the model is far less wrong
than its process noise says, and what a faulty channel contradicts drowns in it. A close look at a window is
one with the least share of the noise with which all may be well (``fit_noise``): what is left of the misfit
then is as much as sound sensors leave, at most ``_CONSISTENT`` times, and a fault must explain it better.
"""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Generator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.isolation.channels import Channels
from flexarm_estimator.isolation.consistency_run import NO_OFFSETS, ConsistencyRun
from flexarm_estimator.isolation.hypotheses import Hypotheses, rearrangements
from flexarm_estimator.isolation.window import StepMaker, Window

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Running = Generator[None, None, ConsistencyRun]
_WORK = 60e3  # multiplications in one piece, about
_OVERHEAD = 3e3  # multiplications that could be done while a step is set up
_PACE = 3  # times as much is done in a piece of a close look: it has one tick in four, and no haste
SHARES = 0.01, 0.03, 0.1, 0.3, 1.0  # of the process noise that may be counted on
_CONSISTENT = 2.0  # misfit of a datum in either half of the window up to which all may be well
_AMPLE = 0.5  # share of that: less noise may do
_OFFSET = 5.0, 1.0  # sigmas of noise: offset, and half of its change over the window, of a sound channel


@dataclass
class Case:
    """What is investigated.

    Attributes:
        channels: All channels.
        faulty: Channels that are known to be at fault.
        maker: Of joint steps, kept between investigations.
        is_urgent: Somebody is suspected, or something is remarkable: several pieces are to be done at a time.
        is_close: No more process noise is to be counted on than is needed.
        share: Of the process noise that is counted on.
        next_share: Where the next search for it is to begin.
    """

    channels: Channels
    faulty: frozenset[int]
    maker: StepMaker
    is_urgent: bool
    is_close: bool = False
    share: float = 1.0
    next_share: float = 1.0

    @property
    def pace(self) -> int:
        """How much is to be done in a piece."""
        return _PACE if self.is_close else 1

    @property
    def is_borne_out(self) -> bool:
        """No close look has had to count on all of the process noise: the model may be right."""
        return not self.is_close or self.share < 1.0

    @property
    def offsets(self) -> Array:
        """One sigma of a constant and of a ramp that make no channel faulty, (m, 2)."""
        return np.outer(self.channels.sigma, _OFFSET)

    @property
    def all_well(self) -> Hypotheses:
        """That and nothing else."""
        return rearrangements(self.channels, frozenset())

    @property
    def steps(self) -> StepMaker:
        """Joint steps with the noise that is counted on."""
        return self.maker.counting(self.share)

    def floor(self, window: Window) -> Array:
        """Return the variance of every row with the force noise it feels, (m,)."""
        return self.steps.step(window.parts[-1], window.t[-1] - window.t[-2]).floor


def fit_noise(case: Case, window: Window, ignored: Mask, hypotheses: Hypotheses) -> Running:
    """Return the run with the least share of the process noise with which all may be well, or with all of it.

    The search begins at the share of the case. With a share less the misfit is at most as many times larger:
    as little as is sure to do is tried next. Where a share does not do, something may be wrong, and what is
    wrong would be fitted, too: all of it is counted on.
    """
    place, whole = SHARES.index(case.share), len(SHARES) - 1
    while True:
        case.share = SHARES[place]
        run = yield from run_over(case, window, ignored, hypotheses)
        excess = excess_of(run, window, ignored)
        least = bisect_left(SHARES, case.share * excess) if excess <= 1.0 else whole
        if place == whole and excess > 1.0 or excess <= 1.0 and least >= place:
            case.next_share = SHARES[max(0, place - 1)] if excess <= _AMPLE else case.share
            return run
        place = least


def excess_of(run: ConsistencyRun, window: Window, ignored: Mask) -> float:
    """Return the misfit of "all well" in the worse half over the most with which all may be well."""
    heard = (~ignored).sum(axis=1).astype(np.float64)
    heard[0] = 0
    most = _CONSISTENT * window.halves(heard).clip(1.0)
    return float((run.misfit[:, 0] / most).max()) if run.is_sound else np.inf


def run_over(
    case: Case, window: Window, ignored: Mask, hypotheses: Hypotheses, offsets: Array = NO_OFFSETS
) -> Running:
    """Return the run of some hypotheses, and offsets, over a window without what is ``ignored``, (k, m)."""
    run = ConsistencyRun(window, hypotheses, case.steps, ignored, offsets)
    m, n_x = window.y.shape[1], window.parts[0].layout.n_x
    columns = len(hypotheses.all) + 2 * len(offsets)
    step = _OVERHEAD + (m + n_x) * (n_x * (n_x + m) + columns * (n_x + m / 2))
    pace = case.pace if window.parts[0].steps.is_constant else 1
    steps = pace * max(1, int(_WORK / step))
    run.reserve()
    yield
    run.advance(1)  # the first one binds machine code
    yield
    while not run.is_done:
        run.advance(steps)
        yield
    return run
