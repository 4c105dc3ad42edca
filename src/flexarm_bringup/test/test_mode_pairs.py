"""Which identified mode is which: what noise made up is none, and those off alike keep their places."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from flexarm_bringup.identify.mode_pairs import match, match_again, strangers
from flexarm_bringup.identify.updating import Fitting, fit_description, update_table
from flexarm_model.identification.described_modes import described_modes
from flexarm_model.modal.fit import PoleFit
from flexarm_model.reading.config import load_config

TWO_LINK = Path(__file__).parents[3] / "docs" / "two_link.yaml"
MODULI = tuple(f"bodies.{body}.pieces.0.youngs_modulus" for body in ("upper", "forearm"))
HOME = np.zeros(2)


def identified(*f_hz: float, sigma: float = 1e-3) -> PoleFit:
    """Return modes as far as a fit of frequencies needs them, each with a relative sigma."""
    f = np.array(f_hz)
    modes = SimpleNamespace(f_hz=f, zeta=np.full(f.size, 0.01), residues=np.zeros((f.size, 1, 1)))
    return cast(
        PoleFit,
        SimpleNamespace(
            model=modes,
            f_std_hz=sigma * f,
            zeta_std=np.full(f.size, np.inf),
        ),
    )


@pytest.mark.slow
def test_a_mode_that_noise_made_up_spoils_no_fit_and_is_told() -> None:
    """It lay in the band, nearest to a mode above that was not excited: a modulus was off by seven sigmas."""
    home = load_config(TWO_LINK).home
    true = 0.9 * described_modes(TWO_LINK, "", False)({}, home)[0]  # 19 % less stiffness
    fit = identified(true[0], true[1], 65.0)
    update, _ = fit_description(Fitting(str(TWO_LINK), "", MODULI), fit)
    assert update.strangers == (65.0,)
    assert np.expm1(update.x) == pytest.approx(np.full(2, -0.19), abs=0.003)
    assert abs(update.after).max() < 1e-3
    told = "65 Hz is no mode of the fitted description: none of it is within 20 %"
    assert told in update_table(update).notes


def test_modes_that_are_all_off_alike_keep_their_places() -> None:
    """Where only damping is fitted, frequencies stay as far off as they were."""
    described, fit = np.array([5.0, 9.0, 20.0]), identified(3.6, 6.4, 14.5)
    first = match(described, HOME, fit)
    assert strangers([first], [match_again(described, first, fit)]) == ()


@pytest.mark.parametrize(("f_hz", "kept"), [((5.1, 13.0), 5.1), ((7.0, 9.1), 9.1)])
def test_of_two_that_contradict_each_other_the_nearer_one_is_kept(
    f_hz: tuple[float, ...], kept: float
) -> None:
    described, fit = np.array([5.0, 9.0]), identified(*f_hz)
    first = match(described, HOME, fit)
    again = match_again(described, first, fit)
    assert again.f_hz[np.isfinite(again.f_hz)].tolist() == [kept]
    assert strangers([first], [again]) == tuple(f for f in f_hz if f != kept)


def test_a_fit_tells_how_many_models_it_has_made() -> None:
    """Of an arm with loops it makes hundreds: minutes without a word."""
    said = list[str]()
    fit = identified(*0.9 * described_modes(TWO_LINK, "", False)({}, load_config(TWO_LINK).home)[0][:2])
    fit_description(Fitting(str(TWO_LINK), "", MODULI), fit, say=said.append)
    assert len(said) > 5 and said == [f"fitting the description: model {i + 1}" for i in range(len(said))]
