"""Rows of several sensors taken together, and their noise as the filter needs it.

``y = C x + D u + sum p_i C_i x + D_w f + v`` with the averaged force noise ``f`` that is part of the
process noise too: the noise of y has covariance ``R + D_w F D_w'`` and is correlated with the state's.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_estimator.judging.scan import Scan
from flexarm_estimator.measurement import Measurement
from flexarm_estimator.state.process import Transition
from flexarm_estimator.state.sensors import LinearRows
from flexarm_estimator.steps.bilinear import Slope, tangent
from flexarm_model.numeric.dense import block_diagonal

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Stack:
    """Rows of sensors sampled at the same instant.

    Attributes:
        names: Sensors, in the order of their rows.
        spans: Rows of each of them.
        C: (m, n_x).
        D: Feed-through of [tau; 1], (m, n_u + 1).
        D_w: Feed-through of force noise, (m, n).
        R: Covariance of the sensors' own noise, (m, m).
        R_total: The same with the force noise they feel, (m, m).
        slopes: What one unit of every learned parameter adds to C and D.
    """

    names: tuple[str, ...]
    spans: tuple[slice, ...]
    C: Array
    D: Array
    D_w: Array
    R: Array
    R_total: Array
    slopes: tuple[Slope, ...] = ()

    def at(self, x: Array, u: Array) -> Stack:
        """Return the tangent at the state x (n_x,) of the sample and the inputs u (n_u + 1,)."""
        if not self.slopes:
            return self
        C, D = tangent(self.C, self.D, self.slopes, (x, u))
        return replace(self, C=C, D=D, slopes=())

    def cross(self, transition: Transition) -> Array:
        """Return the covariance of process noise with the noise of the rows, (n_x, m)."""
        M: Array = transition.force_cross.dot(self.D_w.T)
        return M

    def noise(self, own: Mapping[str, Array]) -> Array:
        """Return ``R_total`` with the covariance of some sensors replaced, (m, m)."""
        if not own:
            return self.R_total
        R = self.R_total.copy()
        for name, span in zip(self.names, self.spans, strict=True):
            if name in own:
                R[span, span] += own[name] - self.R[span, span]
        return R


def stack_rows(models: Sequence[LinearRows], force_cov: Array) -> Stack:
    """Stack the rows of sensors.

    Args:
        models: Sensors in the order wanted, at least one.
        force_cov: Covariance of the averaged force noise, (n, n).
    """
    edges = np.cumsum([0] + [model.C.shape[0] for model in models])
    spans = tuple(slice(int(a), int(b)) for a, b in zip(edges[:-1], edges[1:], strict=True))
    C, D, D_w = (np.vstack([getattr(model, field) for model in models]) for field in ("C", "D", "D_w"))
    R = block_diagonal(*(model.R for model in models))
    total = R + D_w @ force_cov @ D_w.T
    learned = zip(*(model.slopes for model in models), strict=True)
    slopes = tuple(Slope(np.vstack(parts), np.zeros_like(D)) for parts in learned)
    return Stack(tuple(model.name for model in models), spans, C, D, D_w, R, (total + total.T) / 2, slopes)


class StackedSample:
    """What the sensors of a stack said at one instant.

    Attributes:
        stack: Their rows.
        values: What they said, one sensor below the other, (m,).
        own: Covariances that samples bring along, by sensor.
    """

    values: Array | list[float]

    def __init__(self, stack: Stack, samples: Mapping[str, Measurement], scan: Scan | None = None) -> None:
        """Put the samples of ``stack.names`` one below the other, as they are in a ``scan`` of the same."""
        self.stack = stack
        self.own: dict[str, Array] = {}
        if scan is not None and scan.sensors == stack.names:
            self.values = scan.values
            return
        self.values = []
        for name in stack.names:
            _, _, y, R = samples[name]
            self.values += y.tolist()  # on so few numbers cheaper than joining arrays
            if R is not None:
                self.own[name] = R

    def innovation(self, x: Array, u: Array) -> Array:
        """Return measured minus predicted, (m,)."""
        nu: Array = np.array(self.values) - self.stack.C.dot(x) - self.stack.D.dot(u)
        return nu

    def noise(self) -> Array:
        """Return the covariance of the noise, (m, m)."""
        return self.stack.noise(self.own)
