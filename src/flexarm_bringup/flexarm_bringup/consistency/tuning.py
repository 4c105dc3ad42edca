"""Process and sensor noise by maximum likelihood: the physical settings that make a record most likely.

Parameters are logarithms of the factors by which settings of ``EstimatorConfig`` and the sigmas of sensors
differ from what they are, so that they stay positive. The likelihood is that of the innovations of the filter
that the settings name; the curvature at its top gives the uncertainty::

    Cov[p] = (-d2 log L / dp2)^-1

Where the likelihood is flat, the record does not tell: such a parameter is named, and stays as it was. One
that ends at the limit of the search is told from one side only.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from flexarm_bringup.consistency.bag_epochs import Epochs
from flexarm_bringup.consistency.knobs import Knob, Noise, Parameter, Verdict, make_knobs, turn
from flexarm_estimator.filters.choice import FilterMaker
from flexarm_estimator.judging.gate import Gate
from flexarm_estimator.likelihood import Likelihood, log_likelihood
from flexarm_estimator.parts import PartsMaker
from flexarm_estimator.settings import EstimatorConfig
from flexarm_estimator.tool.tip import Kinematics

Array = NDArray[np.float64]
CURVED = 0.1  # step of the logarithms with which the curvature is read
SLOPE = 1e-3  # and the slope
FLAT = 1.0  # log of a factor; a parameter less certain than by e is not told by the record
UNLIKELY = -1e12  # stands for minus infinity, which a search cannot use
ITERATIONS = 40


@dataclass(frozen=True)
class Tuned:
    """A proposal.

    Attributes:
        parameters: What was looked at.
        noise: With those that the record tells.
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
        knobs = make_knobs(noise)
        order, fixed = [knob.name for knob in knobs], dict[str, Parameter]()
        p = np.zeros(len(knobs))
        while True:
            p, H = self._search(noise, knobs, p, end, say)
            inside = [knob.is_inside(change) for knob, change in zip(knobs, p, strict=True)]
            kept, spread = told_by(H, inside), spreads(H)
            verdicts = [_verdict(i in kept, inside[i], spread[i] < FLAT) for i in range(len(knobs))]
            rows = zip(knobs, p.tolist(), spread.tolist(), verdicts, strict=True)
            found = {knob.name: knob.parameter(*row) for knob, *row in rows}
            if len(kept) == len(knobs):
                break
            fixed |= {name: each for name, each in found.items() if each.verdict != "told"}
            at_limit = [i for i, verdict in enumerate(verdicts) if verdict == "limit"]
            noise = turn(noise, [knobs[i] for i in at_limit], p[at_limit])
            knobs, p = [knobs[i] for i in kept], p[kept]
        parameters = {**fixed, **found}
        return Tuned(tuple(parameters[name] for name in order), turn(noise, knobs, p), self.evaluations)

    def _search(
        self, noise: Noise, knobs: Sequence[Knob], p: Array, end: float, say: Callable[[str], None]
    ) -> tuple[Array, Array]:
        """Return where the likelihood of what comes before ``end`` [s] is highest, and its curvature."""

        def loss(p: Array) -> float:
            """Return the negative logarithm of the likelihood at parameters (n_knobs,)."""
            value = self.likelihood(turn(noise, knobs, p), end=end).value
            say(f"searching: {self.evaluations} runs of the filter, {len(knobs)} parameters")
            return -max(value, UNLIKELY)

        if not knobs:
            return p, np.zeros((0, 0))
        options = {"maxiter": ITERATIONS, "eps": SLOPE, "ftol": 1e-9}
        limits = [knob.limits for knob in knobs]
        best = np.asarray(minimize(loss, p, method="L-BFGS-B", bounds=limits, options=options).x)
        return best, curvature(loss, best)


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


def _verdict(is_kept: bool, is_inside: bool, is_certain: bool) -> Verdict:
    if is_kept:
        return "told"
    return "limit" if is_certain and not is_inside else "flat"
