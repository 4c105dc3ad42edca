"""Modes that are not known to their bandwidth are left out with their numbers, the others fitted again."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic_frf import pair, with_noise

from flexarm_model.identification.automatic import identify_modes
from flexarm_model.identification.bootstrap import Scatter
from flexarm_model.identification.held_modes import all_together, held_modes
from flexarm_model.modal.fit import FitOptions, PoleFit


def test_a_mode_whose_sigma_is_more_than_its_bandwidth_is_left_out_and_named() -> None:
    """It was printed with a sigma of many bandwidths, as a mode like the others."""
    modes, clean = pair(12.0)
    frf = with_noise(clean, 40.0, np.random.default_rng(0))
    bandwidth = 2 * modes.zeta[1] * modes.f_hz[1]

    def drawn_again(fit: PoleFit) -> Scatter:
        """Tell a scatter of 1.2 bandwidths of the second mode."""
        upper = fit.model.f_hz > 130.0
        return Scatter(np.where(upper, 1.2 * bandwidth, 0.01), np.where(upper, 0.5, 1e-4))

    held = held_modes(frf, identify_modes(frf), FitOptions(), 0.0, drawn_again)
    assert held.found.fit is not None and held.scatter is not None
    assert held.found.fit.model.f_hz == pytest.approx(modes.f_hz[:1], abs=2.0)
    (unsure,) = held.unsure
    assert unsure.f_hz == pytest.approx(modes.f_hz[1], rel=1e-3)
    assert (
        unsure.f_std_hz == pytest.approx(1.2 * bandwidth, rel=0.05) and unsure.f_std_hz > unsure.bandwidth_hz
    )


def test_modes_that_are_known_stay_with_their_scatter() -> None:
    modes, clean = pair(12.0)
    frf = with_noise(clean, 40.0, np.random.default_rng(0))
    held = held_modes(frf, identify_modes(frf), FitOptions(), 0.0, lambda _: None)
    fit = held.found.fit
    assert fit is not None and not held.unsure and held.scatter is None
    assert fit.model.f_hz == pytest.approx(modes.f_hz[:2], rel=1e-3)
    assert (all_together(fit, None, held.methods).f_std_hz >= fit.f_std_hz).all()
