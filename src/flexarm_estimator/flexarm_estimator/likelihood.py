"""How likely a model makes a record: the log-likelihood of the innovations of the filter in use.

By the chain rule, the density of all samples is the product of those of every innovation given the past::

    log p(y) = -1/2 sum (nu' S^-1 nu + log det S + m log 2 pi)        [Schweppe1965]

The filter is the one that the parts were made with (``parts.steps``), so it may be any (``filters.choice``).
Rows that are sampled together are one innovation, correlated with the process noise as the filter has it;
poses follow in their instant, each looked at once. Offline everything is in order of time, so nothing is
rewound, and nothing is gated: a gate would make the likelihood of rubbish better than that of noise.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf

from flexarm_estimator.adoption import carry_over
from flexarm_estimator.filter import Belief, GuardedFilter, innovation_covariance, normalised_square
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.parts import Parts
from flexarm_estimator.state.state_limits import StateLimits
from flexarm_estimator.steps.joint_step import PreparedStep
from flexarm_estimator.steps.joint_step_cache import JointStepCache
from flexarm_estimator.steps.stack import StackedSample

Array = NDArray[np.float64]
_LOG_2_PI = math.log(2.0 * math.pi)


@dataclass(frozen=True)
class Epoch:
    """An instant of a record.

    Attributes:
        t: [s].
        u: [tau; 1] held since the one before, (n_u + 1,).
        samples: Taken at this instant, by sensor.
        parts: Index of the model that is in use from this instant on.
    """

    t: float
    u: Array
    samples: dict[str, Measurement]
    parts: int = 0


@dataclass
class Likelihood:
    """What the innovations of a record say.

    Attributes:
        value: Log-likelihood; minus infinity when a step could not be computed.
        squares: Sum of ``nu' S^-1 nu``, by sensor.
        counts: Numbers that went into it, by sensor.
        beliefs: After every instant.
    """

    value: float = 0.0
    squares: dict[str, float] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    beliefs: list[Belief] = field(default_factory=list)

    def nis(self) -> dict[str, float]:
        """Return the mean square per number, by sensor."""
        return {name: self.squares[name] / count for name, count in self.counts.items()}

    def note(self, name: str, square: float, size: int) -> None:
        """Count the square of one sensor's innovation."""
        self.squares[name] = self.squares.get(name, 0.0) + square
        self.counts[name] = self.counts.get(name, 0) + size


def log_likelihood(
    epochs: Sequence[Epoch], parts: Sequence[Parts], start: Belief, t: float, counts_from: float = -math.inf
) -> Likelihood:
    """Return the likelihood of a record.

    Args:
        epochs: In order of time.
        parts: Models that its epochs refer to.
        start: Belief at ``t``.
        t: Before the first epoch [s].
        counts_from: Innovations before this time move the state but are not counted [s].
    """
    run = _Run(parts)
    result, belief = Likelihood(), start
    used = epochs[0].parts if epochs else 0
    for epoch in epochs:
        if epoch.parts != used:
            belief = carry_over(parts[used], parts[epoch.parts]).apply(belief)
            used = epoch.parts
        counted = result if epoch.t >= counts_from else Likelihood()
        after = run.step(used, belief, epoch, epoch.t - t, counted)
        if after is None:
            result.value = -math.inf
            return result
        belief, t = after, epoch.t
        result.beliefs.append(belief)
    return result


class _Run:
    """Steps of the filter; those that do not depend on the belief are made once."""

    def __init__(self, parts: Sequence[Parts]) -> None:
        self._parts = parts
        self._caches = [JointStepCache(each.steps, each.sensors.rows) for each in parts]
        self._limits = [StateLimits(each.process.limits) for each in parts]
        self._filters = [GuardedFilter(each.layout.n_x, each.process.system.n_u + 1) for each in parts]

    def step(self, used: int, belief: Belief, epoch: Epoch, dt: float, result: Likelihood) -> Belief | None:
        """Return the belief after an epoch; None when it cannot be computed."""
        u = self._parts[used].steps.inputs(belief, dt, epoch.u)
        joint = self._caches[used].step(belief, dt, u, epoch.samples)
        sample = StackedSample(joint.stack, epoch.samples) if joint.stack else None
        prepared = PreparedStep(dt, joint, u, sample)
        mean, J = prepared.predict(belief)
        nu, S = J[: joint.m, joint.last].copy(), J[: joint.m, : joint.m].copy()
        if joint.stack is not None:
            if not _count(nu, S, result):
                return None
            for name, span in zip(joint.stack.names, joint.stack.spans, strict=True):
                result.note(name, normalised_square(nu[span], S[span, span]), nu[span].size)
        after = prepared.condition(mean, J)
        after = None if after is None else self._fuse_poses(used, after, epoch, result)
        if after is not None:
            self._limits[used].hold(after)
        return after

    def _fuse_poses(self, used: int, belief: Belief, epoch: Epoch, result: Likelihood) -> Belief | None:
        parts = self._parts[used]
        for name, model in parts.sensors.poses.items():
            if name not in epoch.samples:
                continue
            sample = epoch.samples[name]
            try:
                nu, H, spread = parts.steps.look(model, sample.y, belief, epoch.u)
            except ValueError:  # loops do not close where the state is said to be
                return None
            R = (model.R if sample.R is None else sample.R) + spread
            S = innovation_covariance(belief.P, H, R)
            if not _count(nu, S, result):
                return None
            result.note(name, normalised_square(nu, S), nu.size)
            belief = self._filters[used].update(belief, nu, H, R)
        return belief


def _count(nu: Array, S: Array, result: Likelihood) -> bool:
    """Add an innovation's log-density; False when S is not positive definite."""
    L, info = dpotrf(S, lower=1, clean=1)
    if info != 0:
        return False
    white = np.linalg.solve(L, nu)
    half_log_det = float(np.log(L.diagonal()).sum())
    result.value -= 0.5 * (float(white @ white) + nu.size * _LOG_2_PI) + half_log_det
    return True
