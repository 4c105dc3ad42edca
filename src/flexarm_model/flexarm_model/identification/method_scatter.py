"""How far frequencies and dampings depend on the method: the same responses, fitted in other ways.

The ways differ in what an analyst would have had to choose: residues of rank one or free, remainders of
modes out of band, the ends of the band, and the chart's own poles instead of least squares. What they
disagree by is no noise, so that no bootstrap shows it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from flexarm_model.identification.automatic import Identified, driven
from flexarm_model.identification.bootstrap import Scatter
from flexarm_model.modal.fit import FitOptions, PoleFit, fit_poles
from flexarm_model.modal.frf import Frf
from flexarm_model.modal.modes import frequency_and_damping
from flexarm_model.modal.residues import UnderdeterminedError

Array = NDArray[np.float64]
TRIMMED = 0.08  # of the lines, cut from one end of the band
SAME = 0.05  # relative distance from which a frequency is not that mode any more


def method_scatter(frf: Frf, found: Identified, options: FitOptions) -> Scatter | None:
    """Return one sigma over the methods; None when there is no mode or no second method works.

    Args:
        frf: Responses that were fitted.
        found: The modes.
        options: With which they were fitted.
    """
    fit = found.fit
    if fit is None:
        return None
    here = np.stack([fit.model.f_hz, fit.model.zeta])
    values = [here, *(near for near in _answers(frf, found, fit, options) if near is not None)]
    if len(values) < 3:
        return None
    with np.errstate(invalid="ignore"):
        spread = np.sqrt(np.nanmean((np.array(values[1:]) - here) ** 2, axis=0))
    return Scatter(spread[0], spread[1])


def _answers(frf: Frf, found: Identified, fit: PoleFit, options: FitOptions) -> Iterator[Array | None]:
    """Yield frequencies and dampings by every method, (2, r); nan for a mode it has not."""
    chart = np.array([track.pole for track in found.chosen])
    if chart.size:
        yield _nearest(fit, *frequency_and_damping(chart))
    weight = (
        np.ones((frf.f_hz.size, 1)) if options.weight is None else options.weight.reshape(len(frf.f_hz), -1)
    )
    weight = np.broadcast_to(weight, (frf.f_hz.size, frf.H.shape[1]))
    cut = max(1, round(TRIMMED * frf.f_hz.size))
    low, high = weight.copy(), weight.copy()
    low[:cut], high[-cut:] = 0.0, 0.0
    more = tuple(sorted({*options.remainders, 1, 2}))
    below, above = frf.f_hz[cut], frf.f_hz[-1 - cut]
    for other, inside in (
        (FitOptions(False, weight, options.remainders), (0.0, np.inf)),
        (FitOptions(options.rank_one, weight, more), (0.0, np.inf)),
        (FitOptions(options.rank_one, low, options.remainders), (below, np.inf)),
        (FitOptions(options.rank_one, high, options.remainders), (0.0, above)),
    ):
        yield _refit(frf, fit, other, inside)


def _refit(frf: Frf, fit: PoleFit, options: FitOptions, inside: tuple[float, float]) -> Array | None:
    """Return what another fit says of the modes between two frequencies [Hz]; None when it fails."""
    try:
        again = fit_poles(frf, fit.model.poles, driven(fit), options)
    except UnderdeterminedError:
        return None
    if not again.converged:
        return None
    values = _nearest(fit, again.model.f_hz, again.model.zeta)
    values[:, (fit.model.f_hz < inside[0]) | (fit.model.f_hz > inside[1])] = np.nan
    return values


def _nearest(fit: PoleFit, f_hz: Array, zeta: Array) -> Array:
    """Return the values that belong to the modes of a fit, (2, r)."""
    values = np.full((2, fit.model.f_hz.size), np.nan)
    for i, f in enumerate(fit.model.f_hz):
        j = int(abs(f_hz - f).argmin())
        if abs(f_hz[j] / f - 1) < SAME:
            values[:, i] = f_hz[j], zeta[j]
    return values
