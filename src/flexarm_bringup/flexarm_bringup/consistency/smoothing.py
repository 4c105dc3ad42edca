"""A recorded bag estimated once more, every state given also what was sampled up to a lag later."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.bags.bag_writer import BagError
from flexarm_bringup.consistency.recording import NoController, Recording, Tell, telling
from flexarm_bringup.replaying.player import Outgoing, Player
from flexarm_bringup.replaying.replay_bag import NO_ESTIMATE
from flexarm_estimator.exchange import EstimatorExchange
from flexarm_estimator.measurement import SAME_INSTANT
from flexarm_estimator.smoother import FixedLagSmoother, Smoothed

Array = NDArray[np.float64]
NO_TRUTH = "the bag has no truth at the stamps of the estimates"


class Late(NamedTuple):
    """The tip and the modes at k instants, given also what came later.

    Attributes:
        stamps_ns: [ns], (k,).
        tip: Position [m], (k, 3).
        tip_sigma: All directions together [m], (k,).
        eta, eta_dot: Modal coordinates and rates [kg^0.5 m], [kg^0.5 m/s], (k, n_eta).
    """

    stamps_ns: Array
    tip: Array
    tip_sigma: Array
    eta: Array
    eta_dot: Array


def run_smoother(recording: Recording, lag: float, loss: str | None = None, tell: Tell | None = None) -> Late:
    """Feed a bag to an estimator that keeps so long a past, and look back.

    Args:
        recording: The bag.
        lag: What came so much later counts [s].
        loss: What a sample costs that is off, found over the lag (``EstimatorConfig.loss``); None: as it was.
        tell: Is told how many seconds of how many are over.

    Raises:
        BagError: No model of the bag is taken.
    """
    settings = recording.settings
    settings = replace(settings, history=max(settings.history, lag + settings.max_gap + SAME_INSTANT))
    settings = settings if loss is None else replace(settings, loss=loss, horizon=lag)
    exchange = EstimatorExchange(recording.config, settings, recording.epoch_ns)
    looking = _LookingBack(exchange, lag)
    played = Player(looking, NoController(), recording.lockstep).play(recording.bag.records)
    for _ in telling(played, recording.bag, tell):
        pass
    if looking.smoother is None:
        raise BagError(f"{recording.bag.path}: gives no estimate: {exchange.model_fault or NO_ESTIMATE}")
    return late_of(looking.told + looking.smoother.finish(), looking.epoch_ns)


def late_of(told: list[Smoothed], epoch_ns: int) -> Late:
    """Return tip and modes of smoothed states; times count from a stamp [ns]."""
    seen = [item.parts.tip.describe(item.belief) for item in told]
    layouts = [item.parts.layout for item in told]
    return Late(
        np.array([epoch_ns + round(1e9 * item.t) for item in told]),
        np.array([tip.T_world_tip[:3, 3] for tip in seen]),
        np.array([np.sqrt(np.trace(tip.cov_pose[:3, :3])) for tip in seen]),
        np.array([item.belief.x[at.eta] for item, at in zip(told, layouts, strict=True)]),
        np.array([item.belief.x[at.eta_dot] for item, at in zip(told, layouts, strict=True)]),
    )


def tip_error(stamps_ns: Iterable[int], tip: Array, truth: Mapping[int, Array]) -> float:
    """Return the RMS distance of a tip (k, 3) from the truth where there is one [m]; NaN without any."""
    off = [at - truth[stamp] for stamp, at in zip(stamps_ns, tip, strict=True) if stamp in truth]
    return float(np.sqrt(np.mean(np.sum(np.square(off), axis=1)))) if off else float("nan")


def truth_for(stamps_ns: Iterable[int], truth: Mapping[int, Array]) -> Mapping[int, Array]:
    """Return the truth by stamp [ns]; empty where no estimate has one of its stamps."""
    return truth if any(stamp in truth for stamp in stamps_ns) else {}


class _LookingBack:
    """The estimator with a smoother behind it as soon as it exists."""

    def __init__(self, exchange: EstimatorExchange, lag: float) -> None:
        self._exchange, self._lag = exchange, lag
        self.on_sensor, self.on_model = exchange.on_sensor, exchange.on_model
        self.on_intervention = exchange.on_intervention
        self.smoother: FixedLagSmoother | None = None
        self.told: list[Smoothed] = []
        self.epoch_ns = 0

    def step(self, stamp_ns: int) -> Iterable[Outgoing]:
        """Step the estimator, then look back."""
        if self.smoother is None and self._exchange.estimator is not None:
            self.smoother = FixedLagSmoother(self._exchange.estimator, self._lag)
        outgoing = self._exchange.step(stamp_ns)
        if self.smoother is not None and self._exchange.estimate is not None:
            t = self._exchange.estimate.t
            self.epoch_ns = self._exchange.told_ns - round(1e9 * t)
            self.told += self.smoother.look_back(t)
        return outgoing
