"""Two poles that stand for one mode of an arm that is not linear, and modes that only stand close."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from flexarm_model.identification.shadows import shadow_of
from flexarm_model.modal.modes import poles_of
from flexarm_model.modal.residues import ModalFit

Array = NDArray[np.float64]
STRONG, OTHER = np.array([1.0, 0.4]), np.array([-0.3, 1.0])
GAUGE = np.array([0.7])  # a third output


def model(f_hz: list[float], psi: list[Array], driven: list[Array], size: list[float]) -> ModalFit:
    """Return modes of two driven axes and a gauge, damped by 2 %."""
    poles = poles_of(np.array(f_hz), np.full(len(f_hz), 0.02))
    residues = [s * np.outer(np.append(p, GAUGE), L) for p, L, s in zip(psi, driven, size, strict=True)]
    return ModalFit(poles, np.array(residues, complex), (), np.zeros((0, 3, 2)), "receptance", 0.0)


def test_a_pole_of_a_stronger_ones_shape_that_other_motors_drive_is_no_mode() -> None:
    """Identified of a two-link arm in a large motion: 11.57 Hz beside 11.34 Hz, 21.69 beside 21.73."""
    told = model([11.34, 11.57, 21.7], [STRONG, STRONG, OTHER], [STRONG, OTHER, OTHER], [1.0, 0.02, 0.5])
    assert shadow_of(told, (0, 1)).tolist() == [-1, 0, -1]
    turned = model([11.34, 11.57], [1j * STRONG, STRONG * (1 + 0.05j)], [STRONG, OTHER], [0.02, 1.0])
    assert shadow_of(turned, (0, 1)).tolist() == [1, -1]


@pytest.mark.parametrize(
    ("f_hz", "psi", "driven"),
    [
        ([11.34, 11.57], [STRONG, OTHER], [STRONG, OTHER]),  # a close pair
        ([11.34, 11.57], [STRONG, STRONG], [STRONG, STRONG]),  # a damper tuned to it
        ([11.34, 11.34], [STRONG, OTHER], [STRONG, OTHER]),  # a doublet
        ([11.34, 12.5], [STRONG, STRONG], [STRONG, OTHER]),  # further away than a bandwidth
    ],
)
def test_modes_that_stand_close_are_modes(f_hz: list[float], psi: list[Array], driven: list[Array]) -> None:
    assert shadow_of(model(f_hz, psi, driven, [1.0, 0.02]), (0, 1)).tolist() == [-1, -1]


def test_without_the_driven_axes_among_the_outputs_or_with_one_motor_nothing_is_said() -> None:
    told = model([11.34, 11.57], [STRONG, STRONG], [STRONG, OTHER], [1.0, 0.02])
    assert shadow_of(told, (0,)).tolist() == [-1, -1]
    one = ModalFit(told.poles, told.residues[:, :, :1], (), np.zeros((0, 3, 1)), "receptance", 0.0)
    assert shadow_of(one, (0, 1)).tolist() == [-1, -1]
