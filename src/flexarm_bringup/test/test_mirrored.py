"""Modes above half the rate, which samples show in the band: told, paired with nothing, not fitted to."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flexarm_bringup.excite.plan import Wish
from flexarm_bringup.excite.rig_source import RigTest, rig_settings, run_rig_test
from flexarm_bringup.identify.averaging import Averaging
from flexarm_bringup.identify.mirrored import Sampled, mirrored_modes, without_mirrored
from flexarm_bringup.identify.page import build_page
from flexarm_bringup.identify.run import Request, Result, identify
from flexarm_bringup.identify.sources import of_records
from flexarm_bringup.identify.updating import Fitting, fit_description
from flexarm_model.modal.fit import PoleFit
from flexarm_model.modal.residues import ModalFit
from flexarm_model.reading.config import load_config

ARM = Path(__file__).parent / "arms" / "cart_mast.yaml"
MODULUS = "bodies.mast.pieces.0.youngs_modulus"


def identified(f_hz: tuple[float, ...], zeta: tuple[float, ...]) -> PoleFit:
    """Return modes of one output that is no channel of the arm."""
    omega, damping, ones = 2 * np.pi * np.array(f_hz), np.array(zeta), np.ones(len(f_hz))
    poles = omega * (1j * np.sqrt(1 - damping**2) - damping)
    model = ModalFit(poles, np.ones((poles.size, 1, 1), complex), (), np.zeros((0, 1, 1)), "receptance", 0.0)
    return PoleFit(model, 1e-4 * omega, 0.01 * damping, 9 * ones, ones < 0, True, 1)


@pytest.mark.parametrize(("rate_hz", "faster"), [(200.0, 235.1), (1500.0, None)])
def test_a_pole_beside_a_mode_of_the_band_is_a_faster_mode_where_the_rate_shows_one_there(
    rate_hz: float, faster: float | None
) -> None:
    """The mode of 36.9 Hz is found, so that a second pole beside it is another mode."""
    fit = identified((3.777, 34.02, 36.892), (0.006, 0.061, 0.005))
    mirrored = mirrored_modes(fit, Sampled(load_config(ARM), None, False, rate_hz, ()))
    told = [mode and round(mode.f_hz, 1) for mode in mirrored]
    assert told == [None, faster, None]
    own = without_mirrored(fit, mirrored)
    assert own is not None and own.model.f_hz.size == own.f_std_hz.size == 3 - (faster is not None)


@pytest.fixture(scope="module")
def softer() -> Result:
    """What is identified of the arm on the simulated rig, 3 % slower than described."""
    simulation = rig_settings(["frequency_scale=0.97"])
    test = RigTest(str(ARM), wish=Wish(resolution_hz=0.1, periods=3), simulation=simulation)
    records = run_rig_test(test, lambda text: None).records
    source = replace(of_records(records, Averaging(None, "", None)), draw=None)
    return identify(source, Request(None, 0.6, str(ARM)))


@pytest.mark.slow
def test_a_mode_that_samples_show_in_the_band_is_told_and_paired_with_nothing(softer: Result) -> None:
    modes, beside = (build_page([Path("x")], softer).items[i] for i in (0, 1))
    assert [row[6] == "of a faster mode?" for row in modes.rows] == [False, True, False]
    assert [row[4] and round(row[4], 1) for row in beside.rows] == [3.8, None, 36.9]
    assert any("is perhaps the mode of 235.1 Hz, sampled at 200 Hz" in note for note in modes.notes)


@pytest.mark.slow
def test_nothing_is_fitted_to_a_mode_that_is_perhaps_faster(softer: Result) -> None:
    fit = softer.own_fit
    assert fit is not None and fit.model.f_hz.size == 2
    fitting = Fitting(str(ARM), "", (MODULUS,), outputs=softer.responses.outputs)
    update, _ = fit_description(fitting, fit)
    print(f"modulus {210 * np.exp(update.x[0]):.2f} GPa of {210 * 0.97**2:.2f}, strangers {update.strangers}")
    assert 210 * np.exp(update.x[0]) == pytest.approx(210 * 0.97**2, rel=2e-3)
    assert update.strangers == ()
