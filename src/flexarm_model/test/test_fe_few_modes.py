"""Imported bodies that keep few modes, and small ones that keep all they have."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fe_beams import RIGID, load_strip, strip
from fe_bodies import load_arm
from numpy.typing import NDArray
from scipy.linalg import eigh

from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.bodies.model_order import bodies_without_more, with_more_modes
from flexarm_model.manipulator.imported_body import ImportedBody

Array = NDArray[np.float64]
BOTH = {"root", "end"}


def reduction(**says: object) -> dict[str, object]:
    return {"method": "craig_bampton", **says}


def omega(folder: Path, elements: int, modes: int) -> Array:
    """Return the frequencies of a strip whose two ends joints use [rad/s], (modes,)."""
    return reduce_body(load_strip(folder, strip(elements), reduction=reduction(modes=modes)), BOTH).omega


@pytest.mark.parametrize("modes", [2, 3, 4, 6])
def test_the_modes_kept_are_the_bodys_slowest_however_few(modes: int, tmp_path: Path) -> None:
    """Up to six were mixtures of static shapes alone: the fourth of a strip came out 3.2 times too fast."""
    exact = omega(tmp_path, 20, 60)[:modes]
    assert omega(tmp_path, 20, modes) == pytest.approx(
        exact, rel=0.01
    )  # what so few fixed-interface modes leave


def test_a_load_on_an_interface_bends_a_body_of_few_modes_exactly(tmp_path: Path) -> None:
    """Where there is room for all static modes they are kept, whatever the body's own slowest ones are."""
    full, few = (
        reduce_body(load_strip(tmp_path, strip(20), reduction=reduction(modes=n)), BOTH) for n in (60, 7)
    )
    shapes = [np.vstack([body.nodes["end"].Phi, body.nodes["end"].Psi]) / body.omega for body in (full, few)]
    exact, found = (shape @ shape.T for shape in shapes)  # compliance of the end, (6, 6)
    assert found == pytest.approx(exact, rel=1e-9, abs=1e-10 * exact.max())


def test_a_small_body_keeps_all_its_modes_and_no_more(tmp_path: Path) -> None:
    """All that there are were refused: one fewer was the most."""
    solid = strip(2)
    exact = eigh(solid.K[6:, 6:].toarray(), solid.M[6:, 6:].toarray(), eigvals_only=True)  # the root held
    assert omega(tmp_path, 2, 12) == pytest.approx(np.sqrt(exact), rel=1e-6)
    with pytest.raises(ValueError, match="body 'solid': 13 modes asked for, 12 available"):
        omega(tmp_path, 2, 13)


@pytest.mark.parametrize(("modes", "kept"), [(4, 7), (10, 12), (12, 12)])
def test_a_small_body_has_as_many_more_modes_as_there_are(modes: int, kept: int, tmp_path: Path) -> None:
    """The rig and the margins add three: a body that could be served could not be simulated."""
    config = load_arm(tmp_path, strip(2), interfaces=RIGID, reduction=reduction(modes=modes))
    richer = with_more_modes(config, 3).bodies["solid"]
    assert isinstance(richer, ImportedBody) and reduce_body(richer, BOTH).n == kept


@pytest.mark.parametrize(
    ("said", "named"), [({"modes": 4}, []), ({"f_max": "1 kHz"}, ["solid"]), ({"method": "guyan"}, ["solid"])]
)
def test_bodies_that_get_no_more_modes_are_named(
    said: dict[str, object], named: list[str], tmp_path: Path
) -> None:
    config = load_arm(tmp_path, strip(2), interfaces=RIGID, reduction=reduction(**said))
    assert bodies_without_more(config) == named
    assert (with_more_modes(config, 3).bodies["solid"] is config.bodies["solid"]) == bool(named)
