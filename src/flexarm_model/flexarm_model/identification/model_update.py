"""Parameters of a description fitted to identified modes: damped least squares with priors [Friswell1995].

Every unknown parameter is ``p = p_0 exp(x)``, so that it keeps its sign; prior ``x ~ N(0, spread)``::

    min over x   sum (ln f(x) / f)^2 / s_f^2 + sum (ln zeta(x) / zeta)^2 / s_zeta^2
                 + sum |phi(x) - phi|^2 / s_phi^2 + sum (x / spread)^2

with shapes phi at the sensors of length one, where they are known. ``s`` holds the uncertainty of the
measurement and a floor for what the model leaves out. What the data do not tell stays where the prior has it:
a parameter counts as identified when its sigma has at least halved. Parameters that only act together show as
a direction of the posterior that is as wide as the prior. Where more is left after the fit than ``s`` allows,
the description lacks something, and every ``s`` is widened until it explains what is left. Values with which
the arm has no model, because it buckles say, are stepped back from, and told.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_model.identification.equal_parts import merged
from flexarm_model.identification.modal_misfit import Serve, misfit
from flexarm_model.identification.mode_table import ModeTable
from flexarm_model.identification.unknown import Unknown, changed

Array = NDArray[np.float64]
IDENTIFIED = 0.5  # posterior over prior sigma up to which the data have told a parameter
STEP = 1e-4  # of ln p, for the derivative
DONE = 1e-6  # relative: far below any sigma; every further round needs a model per unknown
WIDER = 1.2  # times: a misfit that has grown by less is told without another fit
FIT_ROUNDS = 25  # of a fit at most; where modes are close and change places it would go on for ever


@dataclass(frozen=True)
class Update:
    """What the measurement says of the parameters.

    Attributes:
        unknowns: The parameters.
        x: ln of new over old value, (n,).
        sigma: One sigma of x afterwards, (n,).
        correlation: Of the errors of x, (n, n).
        sensitivity: d ln f / d ln p of every frequency used, (m, n).
        before, after: Relative frequency errors, model over measurement minus one, (m,) each.
        changes: Values for ``load_config``, of the identified parameters only.
        refused: Trials that were stepped back from: their values, and why they have no model.
        strangers: Identified frequencies that are no mode of the fitted model [Hz].
        is_settled: Whether every fit came to rest within ``FIT_ROUNDS``.
        misfit: What is left of all that was measured, per degree of freedom, in sigmas; sigmas are widened by
            it where it is above 1.
    """

    unknowns: tuple[Unknown, ...]
    x: Array
    sigma: Array
    correlation: Array
    sensitivity: Array
    before: Array
    after: Array
    changes: Mapping[str, str | float]
    refused: tuple[str, ...] = ()
    strangers: tuple[float, ...] = ()
    is_settled: bool = True
    misfit: float = 0.0

    @property
    def identified(self) -> NDArray[np.bool_]:
        """Which parameters the data have told, (n,)."""
        spread = np.array([unknown.spread for unknown in self.unknowns])
        return np.asarray(self.sigma <= IDENTIFIED * spread)


def update_model(serve: Serve, unknowns: Sequence[Unknown], tables: Sequence[ModeTable]) -> Update:
    """Fit the unknowns; those that the data do not tell are left alone and the rest fitted again.

    Raises:
        ValueError: There is nothing to fit, the model has fewer modes than a table, or none has a derivative
            where the fit ends.
    """
    if not unknowns or not tables:
        raise ValueError("name at least one parameter and one measured mode")
    free = unknowns = merged(serve, unknowns, tables)
    refused: tuple[str, ...] = ()
    is_settled, widened = True, 1.0
    while True:
        update = _fit(serve, free, tables, unknowns, widened)
        refused, is_settled = (*refused, *update.refused), is_settled and update.is_settled
        if update.misfit > WIDER * widened:
            widened = update.misfit
            continue
        told = np.array([unknown in free for unknown in unknowns]) & update.identified
        still = tuple(unknown for unknown, is_told in zip(unknowns, told, strict=True) if is_told)
        if len(still) == len(free) or not still:
            changes = changed(still, update.x[told])
            return replace(update, changes=changes, refused=refused, is_settled=is_settled)
        free = still


def _fit(
    serve: Serve,
    free: tuple[Unknown, ...],
    tables: Sequence[ModeTable],
    unknowns: tuple[Unknown, ...],
    widened: float,
) -> Update:
    """Fit some of the unknowns; sigma and correlation are those of all of them at the answer.

    Args:
        serve: Modes of the changed description.
        free: Unknowns that are fitted.
        tables: Measured modes.
        unknowns: All unknowns.
        widened: Factor of the sigmas of all that was measured [1].
    """
    where = [unknowns.index(unknown) for unknown in free]
    spread = np.array([unknown.spread for unknown in unknowns])

    def full(x: Array) -> Array:
        """Return the values of all unknowns, (n_unknowns,), from those that are free."""
        whole = np.zeros(len(unknowns))
        whole[where] = x
        return whole

    start, before = misfit(serve, unknowns, tables, full(np.zeros(len(free))))
    refused: list[str] = []

    def residual(x: Array) -> Array:
        """Return what the modes are off in their sigmas, and the unknowns in their spreads; inf: no model."""
        try:
            off = misfit(serve, unknowns, tables, full(x))[0]
            return np.concatenate([off / widened, x / spread[where]])
        except ValueError as error:
            refused.append(_describe(unknowns, full(x), error))
            return np.full(start.size + len(free), np.inf)

    def jacobian(x: Array) -> Array:
        """Return its derivative."""
        slopes = _slopes(serve, unknowns, tables, full(x), where)[0]
        return np.vstack([slopes / widened, np.diag(1 / spread[where])])

    found = scipy.optimize.least_squares(
        residual, np.zeros(len(free)), jac=jacobian, x_scale=spread[where], ftol=DONE, xtol=DONE,
        max_nfev=FIT_ROUNDS,
    )  # fmt: skip
    update = _judged(serve, unknowns, tables, full(found.x), widened, where)
    before, settled = np.expm1(before), found.status != 0
    return replace(update, before=before, refused=tuple(refused), is_settled=settled)


def _judged(
    serve: Serve,
    unknowns: tuple[Unknown, ...],
    tables: Sequence[ModeTable],
    x: Array,
    widened: float,
    where: Sequence[int],
) -> Update:
    """Return what the answer x (n_unknowns,) of a fit is worth; ``where`` are the unknowns that were free."""
    spread = np.array([unknown.spread for unknown in unknowns])
    left, log_f = misfit(serve, unknowns, tables, x)
    J, S = _slopes(serve, unknowns, tables, x, range(len(unknowns)))
    information = J.T @ J / widened**2
    covariance = np.linalg.inv(information + np.diag(spread**-2.0))
    sigma = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(sigma, sigma)
    spent = np.trace((covariance @ information)[np.ix_(where, where)])
    per_freedom = float(np.linalg.norm(left) / np.sqrt(max(left.size - spent, 1.0)))
    after = np.expm1(log_f)
    return Update(unknowns, x, sigma, correlation, S, after, after, {}, misfit=per_freedom)


def _slopes(
    serve: Serve, unknowns: Sequence[Unknown], tables: Sequence[ModeTable], x: Array, which: Sequence[int]
) -> tuple[Array, Array]:
    """Return the derivatives of what ``_misfit`` returns by some of the unknowns, a column each.

    Raises:
        ValueError: There is no model on either side of x.
    """
    weighted, log_f = misfit(serve, unknowns, tables, x)
    J, S = np.empty((weighted.size, len(which))), np.empty((log_f.size, len(which)))
    for column, i in enumerate(which):
        for step in (STEP, -STEP):
            moved = x.copy()
            moved[i] += step
            try:
                w, f = misfit(serve, unknowns, tables, moved)
            except ValueError as error:
                if step < 0.0:
                    raise ValueError(f"no fit beside {_describe(unknowns, moved, error)}") from None
                continue
            J[:, column], S[:, column] = (w - weighted) / step, (f - log_f) / step
            break
    return J, S


def _describe(unknowns: Sequence[Unknown], x: Array, error: Exception) -> str:
    """Return a trial's values and what is wrong with them."""
    pairs = zip(unknowns, x, strict=True)
    return f"{', '.join(f'{unknown.name} = {unknown.text(at)}' for unknown, at in pairs)}: {error}"
