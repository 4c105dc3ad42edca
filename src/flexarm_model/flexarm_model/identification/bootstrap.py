"""How far frequencies and dampings scatter when other blocks had been recorded: bootstrap over averages.

Blocks are drawn with repetition, averaged and fitted again from the poles found; the scatter of the fits is
the uncertainty of the answer, whatever the noise looks like [Efron1979].
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.identification.automatic import driven
from flexarm_model.modal.fit import FitOptions, PoleFit, fit_poles
from flexarm_model.modal.frf import Frf
from flexarm_model.modal.read_only import lock_arrays
from flexarm_model.modal.residues import UnderdeterminedError

Array = NDArray[np.float64]
FEWEST_BLOCKS = 3
FEWEST_FITS = 3


@dataclass(frozen=True)
class Scatter:
    """One sigma over the draws.

    Attributes:
        f_std_hz: Of the natural frequencies [Hz], (r,).
        zeta_std: Of the damping ratios [1], (r,).
    """

    f_std_hz: Array
    zeta_std: Array

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        lock_arrays(self)


def bootstrap(
    draw: Callable[[np.random.Generator], Frf],
    fit: PoleFit,
    options: FitOptions,
    rng: np.random.Generator,
    draws: int = 30,
) -> Scatter:
    """Return the scatter of the modes of ``fit`` over blocks drawn again.

    Args:
        draw: Returns responses in the band of the fit from blocks drawn with repetition.
        fit: Modes found.
        options: With which they were found; lines that are masked there stay masked.
        rng: Draws.
        draws: Number of them.

    Raises:
        ValueError: Hardly a draw could be fitted.
    """
    model, participation, values = fit.model, driven(fit), []
    for _ in range(draws):
        try:
            again = fit_poles(draw(rng), model.poles, participation, options)
        except UnderdeterminedError:
            continue
        if again.converged and not again.at_bound.any():
            values.append(np.concatenate([again.model.f_hz, again.model.zeta]))
    if len(values) < FEWEST_FITS:
        raise ValueError(f"only {len(values)} of {draws} draws could be fitted")
    spread, n = np.std(values, axis=0, ddof=1), model.f_hz.size
    return Scatter(np.array(spread[:n]), np.array(spread[n:]))
