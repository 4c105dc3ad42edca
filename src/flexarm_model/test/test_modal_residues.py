"""Residues of known poles: exact, scaled by a drive point, and refused when the data cannot carry them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from synthetic_frf import FINE, ZETA, locally_damped, pair, poles_of_modes

from flexarm_model.modal.fit import fit_poles
from flexarm_model.modal.frf import Frf, Ports, modal_frf
from flexarm_model.modal.modes import poles_of
from flexarm_model.modal.residues import UnderdeterminedError, fit_residues


def test_known_poles_give_back_exact_residues_shapes_and_stiffness() -> None:
    modes, frf = pair(6.0)
    fit = fit_residues(frf, poles_of(modes.f_hz, modes.zeta), remainders=())
    force = modes.shapes[:, :2].sum(axis=1)
    assert fit.error < 1e-12
    rebuilt = fit.frf(FINE).H
    assert rebuilt == pytest.approx(frf.H, rel=1e-9)
    excited = modes.shapes.T @ force
    expected = modes.shapes.T * (excited / (2j * modes.omega * np.sqrt(1 - ZETA**2)))[:, None]
    assert fit.residues[:, :, 0] == pytest.approx(expected, rel=1e-9)
    direction = force / np.linalg.norm(force)
    assert fit.modal_stiffness(direction) * np.linalg.norm(force) == pytest.approx(modes.omega**2, rel=1e-9)


def test_the_order_of_the_poles_does_not_matter() -> None:
    poles, frf = locally_damped()
    fit = fit_residues(frf, poles[[2, 0, 3, 1]], remainders=())
    rebuilt = fit.frf(frf.f_hz).H
    assert rebuilt == pytest.approx(frf.H, rel=1e-9)
    assert fit.poles == pytest.approx(poles)


def test_a_drive_point_scales_shapes_to_unit_modal_mass() -> None:
    modes, _ = pair(6.0)
    frf = modal_frf(FINE, modes, Ports(np.eye(3)[:, :1], np.eye(3)))
    shapes = fit_residues(frf, poles_of(modes.f_hz, modes.zeta)).shapes((0, 0))
    assert shapes * np.sign(shapes[:, :1].real) == pytest.approx(
        modes.shapes.T * np.sign(modes.shapes[:1].T), abs=1e-9
    )


def refused(action: Callable[[], object], error: type[Exception], text: str) -> None:
    with pytest.raises(error, match=text):
        action()


def test_fits_that_the_data_cannot_carry_are_refused() -> None:
    modes, frf = pair(12.0)
    two = poles_of_modes(modes)[:2]
    three, four = (Frf(FINE[:k], frf.H[:k]) for k in (3, 4))
    refused(lambda: fit_residues(three, two), UnderdeterminedError, "18 equations for 24 unknowns")
    refused(lambda: fit_poles(four, two), UnderdeterminedError, "more lines or fewer modes")
    refused(lambda: fit_residues(frf, two[[0, 0]]), UnderdeterminedError, "cannot be told apart")
    zero = np.zeros((2, 1), dtype=complex)
    refused(lambda: fit_residues(frf, two, zero), UnderdeterminedError, "participation is zero")
    refused(lambda: fit_residues(frf, two.conj()), ValueError, "positive imaginary part")
    refused(lambda: fit_residues(frf, two, weight=-np.ones(FINE.size)), ValueError, "weights >= 0")
    dc = Frf(np.array([0.0, 1.0]), np.ones((2, 1, 1), dtype=complex))
    refused(lambda: fit_residues(dc, two), ValueError, "lines above 0 Hz")
    refused(
        lambda: fit_poles(frf, poles_of(np.array([10.0]), np.array([0.01]))), ValueError, "outside the band"
    )
    refused(lambda: fit_poles(frf, two, np.ones((3, 1), dtype=complex)), ValueError, "does not fit 2 poles")
    both = Frf(FINE, np.repeat(frf.H, 2, axis=2))
    stiffness = fit_residues(both, two).modal_stiffness
    refused(lambda: stiffness(np.ones(3)), ValueError, "2 inputs; a drive point has one")
