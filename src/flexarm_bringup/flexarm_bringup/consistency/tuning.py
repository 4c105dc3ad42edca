"""Process and sensor noise by maximum likelihood: the physical settings that make a record most likely.

Parameters are logarithms of the factors by which settings of ``EstimatorConfig`` and the sigmas of sensors
differ from what they are, so that they stay positive. The likelihood is that of the innovations of the filter
that the settings name; the curvature at its top gives the uncertainty::

    Cov[p] = (-d2 log L / dp2)^-1

What is uncertain by more than a factor of e, or ends at the limit of the search, is put back to what it was
(``search``). Where the record stays as likely, it does not tell: the parameter is named, and stays as it was.
Where it becomes less likely, the record tells only that the parameter is less, or more, than it was.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.consistency.bag_epochs import Epochs
from flexarm_bringup.consistency.knobs import Noise, Parameter, Verdict, make_knobs, turn
from flexarm_bringup.consistency.search import Search
from flexarm_estimator.filters.choice import FilterMaker
from flexarm_estimator.judging.gate import Gate
from flexarm_estimator.likelihood import Likelihood, log_likelihood
from flexarm_estimator.parts import PartsMaker
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.tool.tip import Kinematics

Array = NDArray[np.float64]
CURVED = 0.1  # step of the logarithms with which the curvature is read
FLAT = 1.0  # log of a factor; of a parameter less certain than by e the record does not tell the value
UNLIKELY = -1e12  # stands for minus infinity, which a search cannot use


@dataclass(frozen=True)
class Tuned:
    """A proposal.

    Attributes:
        parameters: What was looked at.
        noise: With those of which the record tells anything.
        evaluations: Runs of the filter that it took.
    """

    parameters: tuple[Parameter, ...]
    noise: Noise
    evaluations: int


class Tuner:
    """The likelihood of one record as a function of noise."""

    def __init__(
        self, record: Epochs, kinematics: Kinematics, settings: EstimatorConfig, settling: float
    ) -> None:
        """Bind a record and the filter that ``settings`` name.

        Innovations of the record's first ``settling`` seconds do not count.

        Raises:
            ValueError: The filter needs the dynamics of the arm, and ``kinematics`` has only its tip.
        """
        self._record, self._kinematics = record, kinematics
        self._filters = FilterMaker(kinematics, settings)  # no knob turns what it is made of
        self._from = record.epochs[0].t + settling
        self.evaluations = 0

    def likelihood(self, noise: Noise, start: float = -np.inf, end: float = np.inf) -> Likelihood:
        """Return the likelihood of what was sampled in [start, end) [s]."""
        self.evaluations += 1
        gate = Gate({spec.name: spec.sigma.tolist() for spec in noise.sensors}, noise.settings)
        maker = PartsMaker(self._kinematics, noise.sensors, noise.settings, gate, self._filters)
        parts = [maker.make(model) for model in self._record.models]
        epochs = [epoch for epoch in self._record.epochs if epoch.t < end]
        return log_likelihood(epochs, parts, parts[0].at_rest(), self._record.t, max(start, self._from))

    def tune(self, noise: Noise, end: float, say: Callable[[str], None] = lambda text: None) -> Tuned:
        """Return the noise that makes what was sampled before ``end`` [s] most likely.

        Args:
            noise: To begin with.
            end: What comes later is not looked at.
            say: Told how far it is.
        """
        knobs = make_knobs(noise, self._record.own)

        def loss(p: Array) -> float:
            """Return the negative logarithm of the likelihood at parameters (n_knobs,)."""
            value = self.likelihood(turn(noise, knobs, p), end=end).value
            say(f"searching: {self.evaluations} runs of the filter, {len(free)} parameters")
            return -max(value, UNLIKELY)

        free, p, spread = list(range(len(knobs))), np.zeros(len(knobs)), np.full(len(knobs), np.inf)
        verdicts: list[Verdict] = ["told"] * len(knobs)
        search = Search(loss, [knob.limits for knob in knobs])
        while free:
            p = search.descend(p, free)
            H = curvature(search.held(p, free), p[free])
            spread[free] = spreads(H)
            kept = [free[i] for i in told_by(H, [knobs[i].is_inside(p[i]) for i in free])]
            if len(kept) == len(free):
                break
            for i in sorted(set(free) - set(kept), key=lambda i: -spread[i]):
                free.remove(i)
                p, verdicts[i] = _put_back(search, p, i, free)
        rows = zip(knobs, p.tolist(), spread.tolist(), verdicts, strict=True)
        return Tuned(
            tuple(knob.parameter(*row) for knob, *row in rows), turn(noise, knobs, p), self.evaluations
        )


def curvature(loss: Callable[[Array], float], p: Array) -> Array:
    """Return the second derivatives of a function of ``p`` (n,) by central differences, (n, n)."""
    n = p.size
    steps = CURVED * np.eye(n)
    H = np.empty((n, n))
    middle = loss(p)
    for i in range(n):
        H[i, i] = (loss(p + steps[i]) - 2 * middle + loss(p - steps[i])) / CURVED**2
        for j in range(i):
            corners = [loss(p + a * steps[i] + b * steps[j]) for a, b in ((1, 1), (1, -1), (-1, 1), (-1, -1))]
            H[i, j] = H[j, i] = (corners[0] - corners[1] - corners[2] + corners[3]) / (4 * CURVED**2)
    return H


def spreads(H: Array) -> Array:
    """Return one sigma of every parameter from the curvature of the loss; huge where it is flat, (n,)."""
    values, vectors = np.linalg.eigh(H)
    variances = 1.0 / np.maximum(values, 1.0 / (1e3 * FLAT) ** 2)
    return np.asarray(np.sqrt((vectors**2 * variances).sum(axis=1)))


def told_by(H: Array, is_inside: Sequence[bool]) -> list[int]:
    """Return the parameters that a likelihood of curvature ``H`` (n, n) tells once the others are fixed.

    Those at their limits are fixed first, then the least certain one until all others are certain.
    """
    kept = [i for i, inside in enumerate(is_inside) if inside]
    while kept:
        spread = spreads(H[np.ix_(kept, kept)])
        worst = int(spread.argmax())
        if spread[worst] < FLAT:
            break
        del kept[worst]
    return kept


def _put_back(search: Search, p: Array, i: int, free: Sequence[int]) -> tuple[Array, Verdict]:
    """Return parameters with ``i`` as before where the record does not mind, and what it tells of it."""
    back = search.without(p, i, free)
    if back is not None:
        return back, "flat"
    return p, "less" if p[i] < 0.0 else "more"
