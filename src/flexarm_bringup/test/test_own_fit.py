"""What a description is fitted to is as sure, and as unsure, as the page says."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from flexarm_bringup.identify import run
from flexarm_bringup.identify.run import NEEDED_LINES, WINDOWED_LINES, Result
from flexarm_model.identification.bootstrap import Scatter
from flexarm_model.modal.fit import PoleFit
from flexarm_model.modal.residues import ModalFit


@pytest.mark.parametrize("is_windowed", [False, True])
def test_a_fit_has_all_that_makes_it_unsure_and_no_damping_that_the_page_does_not_know(
    is_windowed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Dampings beside "not identifiable" were fitted to 8 % of sigma, seven of those off."""
    two = np.ones(2)
    model = cast(ModalFit, SimpleNamespace(f_hz=10 * two, zeta=0.01 * two))
    fit = PoleFit(model, 1e-3 * two, 1e-4 * two, 3.0 * two, two > 2.0, True, 1)
    result = SimpleNamespace(
        found=SimpleNamespace(fit=fit), scatter=Scatter(4e-3 * two, 3e-4 * two),
        methods=Scatter(3e-3 * two, 4e-4 * two), mirrored=(None, None), shadows=(None, None),
        needed_lines=WINDOWED_LINES if is_windowed else NEEDED_LINES,
    )  # fmt: skip
    monkeypatch.setattr(run, "without_mirrored", lambda fit, others: fit)
    assert Result.own_fit.fget is not None
    own = Result.own_fit.fget(cast(Result, result))
    assert own is not None
    np.testing.assert_allclose(own.f_std_hz, 5e-3)
    np.testing.assert_allclose(own.zeta_std, np.inf if is_windowed else 5e-4)
