"""Scatter over methods: small where the data are clear, large where two modes are hardly told apart."""

from __future__ import annotations

import numpy as np
from synthetic_frf import pair, with_noise

from flexarm_model.identification.automatic import identify_modes
from flexarm_model.identification.method_scatter import method_scatter
from flexarm_model.modal.fit import FitOptions
from flexarm_model.modal.frf import Frf


def scatter_and_error(distance: float, level_db: float) -> tuple[np.ndarray, np.ndarray]:
    modes, clean = pair(distance)
    noisy = with_noise(clean, level_db, np.random.default_rng(5))
    found = identify_modes(noisy)
    scatter = method_scatter(noisy, found, FitOptions())
    assert scatter is not None and found.fit is not None
    return scatter.f_std_hz, abs(found.fit.model.f_hz - modes.f_hz[:2])


def test_methods_agree_on_clear_modes_and_disagree_on_close_ones() -> None:
    clear, _ = scatter_and_error(20.0, 60.0)
    close, error = scatter_and_error(5.0, 30.0)
    assert clear.max() < 0.02 and close.max() > 3 * clear.max()
    assert (close > error / 20).all()  # no pretence: within a decade of what it is off by


def test_without_modes_there_is_no_scatter() -> None:
    _, clean = pair(20.0)
    rng = np.random.default_rng(0)
    noise = Frf(clean.f_hz, rng.standard_normal(clean.H.shape).astype(complex), clean.kind)
    assert method_scatter(noise, identify_modes(noise), FitOptions()) is None
