"""How far frequencies and dampings scatter when other blocks had been recorded: bootstrap over averages.

Blocks are drawn with repetition, averaged and fitted again from the poles found; the scatter of the fits is
the uncertainty of the answer, whatever the noise looks like [Efron1979].
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.identification.spectra import BlockSpectra
from flexarm_model.modal.fit import FitOptions, PoleFit, fit_poles
from flexarm_model.modal.read_only import lock_arrays

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Scatter:
    """One sigma over the draws.

    Attributes:
        f_std_hz: Of the natural frequencies [Hz], (r,).
        zeta_std: Of the damping ratios [1], (r,).
        draws: Number of fits that converged [1].
    """

    f_std_hz: Array
    zeta_std: Array
    draws: int

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        lock_arrays(self)


def bootstrap(
    blocks: BlockSpectra,
    fit: PoleFit,
    estimator: str,
    band_hz: tuple[float, float],
    draws: int = 30,
    seed: int = 0,
) -> Scatter:
    """Return the scatter of the modes of ``fit`` over blocks drawn again.

    Args:
        blocks: The spectra that the fit's responses were averaged from.
        fit: Modes found.
        estimator: "H1", "H2" or "Hv".
        band_hz: Band of the fit [Hz].
        draws: Number of draws.
        seed: Of the draws.

    Raises:
        ValueError: There are fewer than three blocks, or no draw could be fitted.
    """
    count, rng = len(blocks.spectra), np.random.default_rng(seed)
    if count < 3:
        raise ValueError(f"{count} block(s) tell nothing about scatter; 3 are needed")
    model, values = fit.model, []
    for _ in range(draws):
        measured = blocks.frf(estimator, model.kind, rng.integers(count, size=count))
        again = fit_poles(measured.frf.band(*band_hz), model.poles, options=FitOptions(rank_one=False))
        if again.converged and not again.at_bound.any():
            values.append(np.concatenate([again.model.f_hz, again.model.zeta]))
    if len(values) < 3:
        raise ValueError(f"only {len(values)} of {draws} draws could be fitted")
    spread, n = np.std(values, axis=0, ddof=1), model.f_hz.size
    return Scatter(np.array(spread[:n]), np.array(spread[n:]), len(values))
