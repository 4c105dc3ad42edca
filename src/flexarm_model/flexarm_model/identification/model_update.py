"""Parameters of a description fitted to identified modes: damped least squares with priors [Friswell1995].

Every unknown parameter is ``p = p_0 exp(x)``, so that it keeps its sign; prior ``x ~ N(0, spread)``::

    min over x   sum (ln f(x) / f)^2 / s_f^2 + sum (ln zeta(x) / zeta)^2 / s_zeta^2
                 + sum |phi(x) - phi|^2 / s_phi^2 + sum (x / spread)^2

with shapes phi at the sensors of length one, where they are known. ``s`` holds the uncertainty of the
measurement and a floor for what the model leaves out. What the data do not tell stays where the prior has it:
a parameter counts as identified when its sigma has at least halved. Parameters that only act together show as
a direction of the posterior that is as wide as the prior. Values with which the arm has no model, because it
buckles say, are stepped back from, and told.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from flexarm_model.identification.described_shapes import in_size
from flexarm_model.identification.mode_table import ModeTable

Array = NDArray[np.float64]
IDENTIFIED = 0.5  # posterior over prior sigma up to which the data have told a parameter
MODEL_F, MODEL_ZETA, MODEL_PHI = 5e-4, 0.02, 0.05  # relative errors that a model may have anyway
STEP = 1e-4  # of ln p, for the derivative
DONE = 1e-6  # relative: far below any sigma; every further round needs a model per unknown
FIT_ROUNDS = 25  # of a fit at most; where modes are close and change places it would go on for ever


@dataclass(frozen=True)
class Unknown:
    """A parameter to fit.

    Attributes:
        path: Dotted path in the description.
        number: Its value there, in its own unit.
        unit: That unit; empty for a plain number.
        spread: One sigma of its relative error before the measurement [1].
    """

    path: str
    number: float
    unit: str
    spread: float

    def text(self, x: float) -> str | float:
        """Return the value at ``p_0 exp(x)`` as the description writes it."""
        value = float(f"{self.number * np.exp(x):.9g}")
        return f"{value:.9g} {self.unit}" if self.unit else value


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

    @property
    def identified(self) -> NDArray[np.bool_]:
        """Which parameters the data have told, (n,)."""
        spread = np.array([unknown.spread for unknown in self.unknowns])
        return np.asarray(self.sigma <= IDENTIFIED * spread)


Serve = Callable[[Mapping[str, str | float], Array], tuple[Array, ...]]
"""Frequencies [Hz], damping ratios [1], perhaps shapes of the changed description at a pose, slowest first.

Shapes are (modes, n_out), of the slowest modes; where a table has none they are not looked at.
"""


def update_model(serve: Serve, unknowns: Sequence[Unknown], tables: Sequence[ModeTable]) -> Update:
    """Fit the unknowns; those that the data do not tell are left alone and the rest fitted again.

    Raises:
        ValueError: There is nothing to fit, the model has fewer modes than a table, or none has a derivative
            where the fit ends.
    """
    free = tuple(unknowns)
    if not free or not tables:
        raise ValueError("name at least one parameter and one measured mode")
    refused: tuple[str, ...] = ()
    is_settled = True
    while True:
        update = _fit(serve, free, tables, tuple(unknowns))
        refused, is_settled = (*refused, *update.refused), is_settled and update.is_settled
        told = np.array([unknown in free for unknown in unknowns]) & update.identified
        still = tuple(unknown for unknown, is_told in zip(unknowns, told, strict=True) if is_told)
        if len(still) == len(free) or not still:
            changes = {unknown.path: unknown.text(x) for unknown, x, is_told
                       in zip(unknowns, update.x, told, strict=True) if is_told}  # fmt: skip
            return Update(
                tuple(unknowns), update.x, update.sigma, update.correlation, update.sensitivity,
                update.before, update.after, changes, refused, is_settled=is_settled,
            )  # fmt: skip
        free = still


def _fit(
    serve: Serve, free: tuple[Unknown, ...], tables: Sequence[ModeTable], unknowns: tuple[Unknown, ...]
) -> Update:
    """Fit some of the unknowns; sigma and correlation are those of all of them at the answer."""
    where = [unknowns.index(unknown) for unknown in free]
    spread = np.array([unknown.spread for unknown in unknowns])

    def full(x: Array) -> Array:
        """Return the values of all unknowns, (n_unknowns,), from those that are free."""
        whole = np.zeros(len(unknowns))
        whole[where] = x
        return whole

    start, before = _misfit(serve, unknowns, tables, full(np.zeros(len(free))))
    refused: list[str] = []

    def residual(x: Array) -> Array:
        """Return what the modes are off in their sigmas, and the unknowns in their spreads; inf: no model."""
        try:
            return np.concatenate([_misfit(serve, unknowns, tables, full(x))[0], x / spread[where]])
        except ValueError as error:
            refused.append(_describe(unknowns, full(x), error))
            return np.full(start.size + len(free), np.inf)

    def jacobian(x: Array) -> Array:
        """Return its derivative."""
        return np.vstack([_slopes(serve, unknowns, tables, full(x), where)[0], np.diag(1 / spread[where])])

    found = least_squares(
        residual, np.zeros(len(free)), jac=jacobian, x_scale=spread[where], ftol=DONE, xtol=DONE,
        max_nfev=FIT_ROUNDS,
    )  # fmt: skip
    x = full(found.x)
    log_f = _misfit(serve, unknowns, tables, x)[1]
    J, S = _slopes(serve, unknowns, tables, x, range(len(unknowns)))
    covariance = np.linalg.inv(J.T @ J + np.diag(spread**-2.0))
    sigma = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(sigma, sigma)
    after = np.expm1(log_f)
    told = tuple(refused), (), found.status != 0
    return Update(unknowns, x, sigma, correlation, S, np.expm1(before), after, {}, *told)


def _slopes(
    serve: Serve, unknowns: Sequence[Unknown], tables: Sequence[ModeTable], x: Array, which: Sequence[int]
) -> tuple[Array, Array]:
    """Return the derivatives of what ``_misfit`` returns by some of the unknowns, a column each.

    Raises:
        ValueError: There is no model on either side of x.
    """
    weighted, log_f = _misfit(serve, unknowns, tables, x)
    J, S = np.empty((weighted.size, len(which))), np.empty((log_f.size, len(which)))
    for column, i in enumerate(which):
        for step in (STEP, -STEP):
            moved = x.copy()
            moved[i] += step
            try:
                w, f = _misfit(serve, unknowns, tables, moved)
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
    return f"{', '.join(f'{unknown.path} = {unknown.text(at)}' for unknown, at in pairs)}: {error}"


def _misfit(
    serve: Serve, unknowns: Sequence[Unknown], tables: Sequence[ModeTable], x: Array
) -> tuple[Array, Array]:
    """Return the weighted errors of all that is known, and ln of model over measured frequency."""
    changes = {unknown.path: unknown.text(value) for unknown, value in zip(unknowns, x, strict=True)}
    weighted, logs = [], []
    for table in tables:
        f_hz, zeta, *shapes = serve(changes, table.pose)
        if f_hz.size < table.f_hz.size:
            raise ValueError(f"{table.f_hz.size} modes were measured, the model has {f_hz.size}")
        f_hz, zeta = f_hz[: table.f_hz.size], zeta[: table.f_hz.size]
        log_f, log_zeta = np.log(f_hz / table.f_hz), np.log(np.maximum(zeta, 1e-12) / table.zeta)
        s_f = np.hypot(np.nan_to_num(table.f_std_hz) / table.f_hz, MODEL_F)
        s_zeta = np.hypot(np.nan_to_num(table.zeta_std) / np.nan_to_num(table.zeta, nan=1.0), MODEL_ZETA)
        weighted += [log_f[np.isfinite(log_f)] / s_f[np.isfinite(log_f)]]
        weighted += [log_zeta[np.isfinite(log_zeta)] / s_zeta[np.isfinite(log_zeta)]]
        weighted += [_shape_misfit(each, table) for each in shapes if table.shapes.size]
        logs.append(log_f[np.isfinite(log_f)])
    return np.concatenate(weighted), np.concatenate(logs)


def _shape_misfit(shapes: Array, table: ModeTable) -> Array:
    """Return the weighted errors of the shapes that are known, either sign allowed."""
    count = min(len(shapes), len(table.shapes))
    measured, seen = table.shapes[:count], in_size(shapes[:count], table.size)
    known = np.isfinite(measured).all(axis=1)
    measured, seen = measured[known], seen[known]
    signs = np.where(np.sum(measured * seen, axis=1, keepdims=True) < 0.0, -1.0, 1.0)
    return np.asarray((signs * seen - measured).ravel() / MODEL_PHI)
