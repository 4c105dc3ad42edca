"""Bodies whose stiffness resists rigid motion, whatever the size of their elements."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fe_beams import load_strip, strip
from fe_bodies import block, load_body
from scipy import io

from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.fe_import.checks import check_model
from flexarm_model.fe_import.fe_model import FeModel
from flexarm_model.fe_import.hexahedra import Solid
from flexarm_model.fe_import.rigid_motions import rigid_motions
from flexarm_model.manipulator.imported_body import ImportedBody

BOTH = {"root", "end"}


def as_read(solid: Solid) -> FeModel:
    return FeModel("solid", solid.x, solid.M, solid.K, None)


def rounded(body: ImportedBody, digits: int) -> ImportedBody:
    """Return a body whose matrices are written anew with so many digits."""
    for file in (body.mass, body.stiffness):
        io.mmwrite(file.path, io.mmread(file.path), precision=digits, symmetry="symmetric")
    return body


@pytest.mark.parametrize(("elements", "spring"), [(20, 1e2), (20, 1e3), (20, 1e5), (100, 1e5), (200, 1e6)])
def test_a_supported_body_is_refused_however_fine_its_mesh(
    elements: int, spring: float, tmp_path: Path
) -> None:
    """Its force was compared with the largest stiffness, of the elements: 13.5 Hz were served as 117."""
    body = load_strip(tmp_path, strip(elements, spring=spring))
    with pytest.raises(ValueError, match="body 'solid': the stiffness resists rigid motion.* swing at .* Hz"):
        reduce_body(body, BOTH)


def test_the_motion_that_is_resisted_is_named_with_its_frequency(tmp_path: Path) -> None:
    solid = strip(20, spring=1e3)
    frequency = np.sqrt(2 * 1e3 / (solid.M.diagonal()[::6].sum())) / (2 * np.pi)
    said = f"the translation along y, which would swing at {frequency:.3g} Hz: .* of mode 1, 18.12 Hz with"
    with pytest.raises(ValueError, match=said):
        reduce_body(load_strip(tmp_path, solid), BOTH)
    problem = check_model(as_read(solid)).problems[-1]
    assert "expected the 6 rigid ones (the stiffness resists most of all the rotation about z" in problem


def test_what_a_free_body_holds_against_rigid_motion_is_rounding() -> None:
    rigid = rigid_motions(as_read(strip(40)))
    stiffest = abs(strip(40).K).max()
    assert abs(rigid.stiffness).max() < 1e-12 * stiffest
    assert rigid.mass[:3, 3:] == pytest.approx(0.0, abs=1e-15)  # about the centre of mass


@pytest.mark.parametrize(("elements", "off"), [(20, 4e-4), (100, 1.1e-3)])
def test_seven_digits_are_enough_where_they_tell_the_modes(elements: int, off: float, tmp_path: Path) -> None:
    exact = reduce_body(load_strip(tmp_path, strip(elements)), BOTH).omega[0]
    assert reduce_body(rounded(load_strip(tmp_path, strip(elements)), 7), BOTH).omega[0] == pytest.approx(
        exact, rel=off
    )


def test_digits_that_spoil_a_mode_are_refused(tmp_path: Path) -> None:
    """Of 200 elements seven digits leave a first mode that is wrong by 4 %: 12.99 Hz instead of 13.50."""
    with pytest.raises(ValueError, match="run away at .* of mode 1, 12.99 Hz .* with all its digits"):
        reduce_body(rounded(load_strip(tmp_path, strip(200)), 7), BOTH)
    whole = reduce_body(rounded(load_strip(tmp_path, strip(200)), 9), BOTH)
    assert whole.omega[0] == pytest.approx(2 * np.pi * 13.5, rel=1e-3)


def test_solids_need_more_digits_than_seven(tmp_path: Path) -> None:
    """They were enough for the check of force, and 93.9 Hz were served for 82.8."""
    body = load_body(tmp_path, block(20))
    assert reduce_body(body, BOTH).omega[0] == pytest.approx(2 * np.pi * 82.75, rel=1e-3)
    with pytest.raises(ValueError, match="23 % of the squared frequency of mode 1, 93.94 Hz"):
        reduce_body(rounded(body, 7), BOTH)
