"""Weights and horizon by search: moves on twins of the updated arm, one setting at a time, until none helps.

Rules carry settings over to another arm; they do not make them good for it. What is left after the moves is
asked of the updated description itself, simulated with more modes than are served. A description is known to
a few sigma only, so there are two twins, with frequencies off by three sigma either way, and each moves with
two noises of its own. A step multiplies or divides one setting by ``STEP`` and is kept when it lowers the
residual by ``GAIN``, when neither tracking nor settling gets worse than ``WORSE`` allows, and when every
margin that was kept is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import cycle

import numpy as np

from flexarm_bringup.retune.bench import Bench, Outcome, Settings, together
from flexarm_bringup.retune.horizon import MOST, spread_blocks
from flexarm_bringup.retune.noise import LEAST, SIGMAS
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.tasks.task import Task
from flexarm_controller.settings import MpcConfig
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.settings.parameters import ParameterError

SEEDS = (101, 102), (103, 104)  # of each twin; the trial has others
FARTHEST = 0.5  # of the frequencies that a twin may be off: no simulated arm is softer than by half
STEP = 1.6
GAIN = 0.98  # of the residual, at most, that a step leaves
WORSE = 1.05  # times what the rules' settings track and settle with, at most
TRIES = 24  # steps: minutes
SEARCHED = (
    "horizon",
    "position_error",
    "velocity_error",
    "tip_error",
    "tip_angle_error",
    "input_acceleration",
    "input_jerk",
    "modal_energy",
)
Accept = Callable[[Settings], bool]


@dataclass(frozen=True)
class Step:
    """A step that was kept: the setting, its factor, the residual then [m/s^2]."""

    name: str
    factor: float
    residual: float


@dataclass(frozen=True)
class Search:
    """What was found.

    Attributes:
        mpc: The settings.
        begin: Residual with the rules' settings, on the twins [m/s^2].
        steps: Those kept, in order.
        tries: How many were tried.
    """

    mpc: MpcConfig
    begin: float
    steps: tuple[Step, ...]
    tries: int


@dataclass(frozen=True)
class Score:
    """What settings are worth on all twins: the worst of each, RMS of what is left."""

    residual: float
    tracking: float
    settling: float
    is_stopped: bool

    def is_better(self, than: Score, start: Score) -> bool:
        """Tell whether it is enough better than another score, and not worse than allowed.

        An arm that was stopped is quiet, and no measure: whatever is not stopped is better.
        """
        if self.is_stopped or than.is_stopped:
            return not self.is_stopped
        return (
            self.residual <= GAIN * than.residual
            and self.tracking <= WORSE * start.tracking
            and self.settling <= start.settling + (WORSE - 1.0) * abs(start.settling)  # < 0: before the end
        )


Scoring = Callable[[Settings, float], Score | None]


class Twins:
    """The updated arm as it may be."""

    def __init__(self, benches: Sequence[Bench]) -> None:
        """Keep them, as many as there are ``SEEDS``."""
        self._benches = benches

    def score(self, settings: Settings, enough: float) -> Score | None:
        """Return what settings are worth; None as soon as more than ``enough`` [m/s^2] is left for sure."""
        outcomes: list[Outcome] = []
        most = sum(map(len, SEEDS)) * enough**2
        for bench, seeds in zip(self._benches, SEEDS, strict=True):
            for seed in seeds:
                outcomes.append(bench.run(settings, seed))
                if sum(one.residual.acceleration**2 for one in outcomes) > most:
                    return None
        return score_of(outcomes)


def twins_of(updated: ManipulatorConfig, task: Task, doubt: float) -> Twins:
    """Build both twins.

    Args:
        updated: The description.
        task: The moves.
        doubt: One sigma of the frequencies, relative [1].

    Raises:
        ValueError: The arm cannot do the moves.
    """
    off = min(max(SIGMAS * doubt, LEAST), FARTHEST)
    rigs = [RigSettings(frequency_scale=1.0 + sign * off) for sign in (1.0, -1.0)]
    return Twins([Bench(updated, task, updated, rig) for rig in rigs])


def score_of(outcomes: Sequence[Outcome]) -> Score:
    """Return the score of several runs."""
    residual = together(tuple(left for one in outcomes for left in one.residuals))
    tracking = max(one.tracking for one in outcomes)
    return Score(residual.acceleration, tracking, residual.settling, any(one.stopped for one in outcomes))


def search(
    start: Settings, score: Scoring, accept: Accept, say: Callable[[str], None], most: int = TRIES
) -> Search:
    """Return better weights for the same filter.

    Args:
        start: Settings by the rules.
        score: What settings are worth, or nothing where more than so much is left.
        accept: Whether margins are kept with them.
        say: Is told what is tried.
        most: Steps to try, at most.
    """
    estimator, mpc = start
    first = score(start, np.inf)
    if first is None:
        return Search(mpc, np.nan, (), 0)
    best, begin = first, first.residual
    steps: list[Step] = []
    names = [name for name in SEARCHED if getattr(mpc, name)]
    tries = in_vain = 0
    for name in cycle(names):
        in_vain += 1
        for factor, candidate in _beside(mpc, name):
            say(f"weights: {name} x {factor:.3g}, so far {best.residual:.3g} m/s^2 are left")
            tries += 1
            enough = np.inf if best.is_stopped else GAIN * best.residual
            found = _score(score, (estimator, candidate), enough)
            if found and found.is_better(best, first) and accept((estimator, candidate)):
                first = found if first.is_stopped else first
                mpc, best, in_vain = candidate, found, 0
                steps.append(Step(name, factor, found.residual))
                break
        if in_vain == len(names) or tries >= most:
            break
    return Search(mpc, begin, tuple(steps), tries)


def _beside(mpc: MpcConfig, name: str) -> Iterator[tuple[float, MpcConfig]]:
    """Yield the settings with one of them a step larger, and a step smaller, where they are allowed."""
    for factor in (STEP, 1 / STEP):
        value = getattr(mpc, name) * factor
        if name == "horizon":
            horizon = min(max(round(value), 2), int(MOST))
            changes = {"horizon": horizon, "blocks": spread_blocks(mpc.blocks, horizon)}
        else:
            changes = {name: value}
        try:
            candidate = replace(mpc, **changes)
        except ParameterError:
            continue
        if candidate != mpc:
            yield factor, candidate


def _score(score: Scoring, settings: Settings, enough: float) -> Score | None:
    """Return the score, or nothing where no law comes of the settings or it cannot do the moves."""
    try:
        return score(settings, enough)
    except (ValueError, np.linalg.LinAlgError):
        return None
