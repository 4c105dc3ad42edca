"""Moving-horizon estimation with robust losses: what the gate lets pass and later samples contradict.

Sought are the states of the last ``horizon`` seconds that minimise ::

    |x_0 - x_0|0|^2_P0  +  sum |w_k|^2_Q  +  sum rho(|v_k|_R)     x_k+1 = A x_k + B u + w_k
                                                                  y_k = C x_k + D u + D_w f_k + v_k

whose arrival cost is the filter's belief at the beginning [Rao2003]. With rho(z) = z^2 that is the Kalman
filter, so a loss is a matter of weights: in every step each sample of the horizon gets the noise
``R / weight`` with ``weight = rho'(z) / (2 z)`` at the smoothed states, and the horizon is computed again.
One pass per step is enough: the next goes on from there. What is older than the horizon keeps its weight.

An accelerometer feels forces f that move the arm, too: how much of what is left of its sample is its own
noise follows from both, ``v = [0 R] [Q M; M' R_total]^-1 [w; y - C x - D u]``.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dposv

from flexarm_estimator.filter import Belief, normalised_square
from flexarm_estimator.history import Instant
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.recomputation import compute
from flexarm_estimator.robust.losses import LOSSES, Loss
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.smoothing import smooth
from flexarm_model.settings.parameters import ParameterError

Array = NDArray[np.float64]
_LEAST = 1e-6  # weight
_TINY = 1e-300
_SAME = 1e-3  # relative; a weight that changes by less is the same


class Weighed(Measurement):
    """A sample with a covariance that follows from its weight.

    Attributes:
        told: The sample as it came.
        weight: In (0, 1].
    """

    told: Measurement
    weight: float

    @classmethod
    def of(cls, sample: Measurement, R: Array, weight: float) -> Weighed:
        """Return a sample whose noise is ``R`` (m, m) over a weight."""
        weighed = cls(sample.sensor, sample.t, sample.y, R / weight)
        weighed.told, weighed.weight = sample, weight
        return weighed


class _Noise(NamedTuple):
    """What is noise in a sample as it came: covariance of the sensor's own, (m, m), and the noise, (m,)."""

    sample: Measurement
    R: Array
    v: Array


class MovingHorizon:
    """Weighs the samples of the last seconds."""

    def __init__(self, loss: Loss, length: float) -> None:
        """Weigh by ``loss`` over ``length`` seconds."""
        self._loss, self._length = loss, length

    def settle(self, instants: Sequence[Instant]) -> bool:
        """Weigh the samples anew and compute their instants again; return whether anything has changed.

        Args:
            instants: The recent past, computed; the first is the fixed start.
        """
        begin = instants[-1].t - self._length
        first = next((i for i, instant in enumerate(instants) if i and instant.t > begin), len(instants))
        beliefs = smooth(instants[first - 1 :])
        weighed = [
            index
            for index, pair in enumerate(pairwise(beliefs), first)
            if self._weigh(instants[index], _noises(instants[index], instants[index - 1].t, *pair))
        ]
        if weighed:
            compute(instants, weighed[0])
        return bool(weighed)

    def _weigh(self, instant: Instant, noises: Iterable[_Noise]) -> bool:
        """Weigh the samples of an instant by their noise; return whether a weight has changed."""
        changed = False
        for sample, R, v in noises:
            weight = max(self._loss(normalised_square(v, R) / v.size), _LEAST)
            before = _weight(instant.fused[sample.sensor])
            if abs(weight - before) > _SAME * before:
                instant.fused[sample.sensor], changed = Weighed.of(sample, R, weight), True
        if changed:
            instant.prepared = instant.scan = None  # they have the noise from before
        return changed


def _noises(instant: Instant, t: float, before: Belief, after: Belief) -> Iterator[_Noise]:
    """Return the noise in the samples of an instant, given the states at ``t`` [s] and at it."""
    parts = instant.parts
    names = tuple([name for name in parts.sensors.rows if name in instant.fused])
    if names:
        yield from _of_rows(instant, names, instant.t - t, before, after)
    for name, model in parts.sensors.poses.items():
        if name in instant.fused:
            told = _told(instant.fused[name])
            try:
                nu = parts.steps.look(model, told.y, after, instant.u).nu
            except ValueError:  # loops do not close there
                continue
            yield _Noise(told, model.R if told.R is None else told.R, nu)


def _of_rows(
    instant: Instant, names: tuple[str, ...], dt: float, before: Belief, after: Belief
) -> Iterator[_Noise]:
    """Return the noise in the samples of sensors that are rows; nothing where rounding forbids it."""
    u, parts, steps = instant.inputs, instant.parts, instant.parts.steps
    step = steps.transition(before, dt, u).at(before.x, u)
    stack = steps.rows(names, after, u).at(after.x, u)
    told = [_told(instant.fused[name]) for name in names]
    own = [
        stack.R[span, span] if sample.R is None else sample.R
        for sample, span in zip(told, stack.spans, strict=True)
    ]
    weighed = {name: R / _weight(instant.fused[name]) for name, R in zip(names, own, strict=True)}
    n, m = before.x.size, len(stack.C)
    joint, rest = np.zeros((n + m, n + m)), np.empty(n + m)
    joint[:n, :n], joint[:n, n:], joint[n:, n:] = step.Q, stack.cross(step), stack.noise(weighed)
    if instant.reopening is not None:
        joint[:n, :n] += parts.fusion.widen(instant.reopening)
    rest[:n] = after.x - step.A.dot(before.x) - step.B.dot(u)
    rest[n:] = [value for sample in told for value in sample.y.tolist()]
    rest[n:] -= stack.C.dot(after.x) + stack.D.dot(u)
    scale = np.sqrt(np.maximum(joint.diagonal(), _TINY))
    joint /= scale[:, None] * scale
    _, z, info = dposv(joint.T, rest / scale, lower=1)  # of the upper triangle
    if info:
        return
    z = z[n:] / scale[n:]
    for sample, span, R in zip(told, stack.spans, own, strict=True):
        yield _Noise(sample, R, weighed[sample.sensor].dot(z[span]))


def _told(sample: Measurement) -> Measurement:
    return sample.told if isinstance(sample, Weighed) else sample


def _weight(sample: Measurement) -> float:
    return sample.weight if isinstance(sample, Weighed) else 1.0


def horizon_of(config: EstimatorConfig) -> MovingHorizon | None:
    """Return what the settings ask for; None where squares are enough, which is the filter alone.

    Raises:
        ParameterError: The horizon is longer than the history that is kept.
    """
    loss = LOSSES.get(config.loss)
    if loss is not None and config.horizon > config.history:
        raise ParameterError(
            f"horizon: {config.horizon:g} s is longer than history, {config.history:g} s: "
            "nothing older is kept"
        )
    return None if loss is None else MovingHorizon(loss, config.horizon)
