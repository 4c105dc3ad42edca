"""Mass matrices that act differently along x, y and z: told, and refused where they are no body's."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fe_beams import strip
from fe_bodies import block, bracket, load_body, model, write_arm
from scipy import sparse

from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.fe_import.__main__ import main
from flexarm_model.fe_import.checks import check_model, refuse_unsound
from flexarm_model.fe_import.fe_model import FeModel
from flexarm_model.fe_import.hexahedra import Solid

BOTH = {"root", "end"}


def scaled(solid: Solid, along: list[float]) -> Solid:
    """Return a solid with the mass of every node along x, y and z times a factor each."""
    factor = np.tile(np.sqrt([*along, 1.0, 1.0, 1.0][: solid.M.shape[0] // len(solid.x)]), len(solid.x))
    scale = sparse.diags_array(factor)
    return replace(solid, M=(scale @ solid.M @ scale).tocsr())


@pytest.mark.parametrize(("share", "along_y"), [(0.0, "0"), (0.5, "0.1728")], ids=["none", "half"])
def test_a_mass_whose_inertia_is_no_bodys_is_refused_by_name(
    share: float, along_y: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It passed with "problems none", an inertia of -0.0192 kg m^2 and its middle at 150 mm of 200 mm."""
    solid = scaled(block(lumped=True), [1.0, share, 1.0])
    found = check_model(model(solid))
    assert found.rigid.inertia_about_com[2, 2] < 1e-15 and found.rigid.com[0] < 0.19  # of 0.2 m
    (said,) = found.problems
    assert "moment of inertia about its centre of mass" in said and "[0, 0, 1]" in said
    assert f"its mass is 0.3456, {along_y}, 0.3456 kg along x, y, z" in said
    assert not any("fluid" in odd for odd in found.suspicions)
    file = load_body(tmp_path, solid)
    with pytest.raises(ValueError, match="body 'solid': its moment of inertia about its centre of mass"):
        reduce_body(file, BOTH)
    assert main([str(write_arm(tmp_path, solid)), "solid"]) == 1 and said in capsys.readouterr().out


def test_a_mass_that_differs_a_little_is_told_and_is_no_problem(tmp_path: Path) -> None:
    """Water that moves with a body adds mass across it."""
    solid = scaled(bracket(), [1.0, 1.3, 1.1])
    found = check_model(model(solid))
    mass = found.rigid.motions.diagonal()[:3]
    assert mass[1:] == pytest.approx(mass[0] * np.array([1.3, 1.1]), rel=1e-12)
    (said,) = found.suspicions
    assert said.startswith(f"its mass is {', '.join(f'{m:.4g}' for m in mass)} kg along x, y, z")
    assert f"the mean, {mass.mean():.4g} kg" in said and found.problems == [] and said in found.text()
    assert f"  mass along x, y, z [kg]          {mass[0]:.6g}, {mass[1]:.6g}, {mass[2]:.6g}" in found.text()
    reduce_body(load_body(tmp_path, solid), BOTH)


@pytest.mark.parametrize(("share", "is_told"), [(1.0, False), (1.0005, False), (1.003, True)])
def test_a_thousandth_is_told(share: float, is_told: bool) -> None:
    found = check_model(model(scaled(bracket(), [1.0, 1.0, share])))
    assert bool(found.suspicions) == is_told and found.problems == []


def test_mass_that_differs_along_oblique_axes_is_told() -> None:
    """Along x and y it is the same, and a push along x moves it along y."""
    solid, turn = bracket(lumped=True), np.eye(3)
    turn[:2, :2] = [[1.0, 0.2], [0.2, 1.0]]
    mass = solid.M.diagonal()[::3]
    M = sparse.kron(sparse.diags_array(mass), turn, format="csr")
    (said,) = check_model(replace(model(solid), M=M)).suspicions
    assert f"and {0.2 * mass.sum():.4g} kg between them" in said


@pytest.mark.parametrize(("added", "origin"), [(1.0, 0.0), (1.0, 30.0), (1.2, 0.0)])
def test_a_straight_line_of_masses_has_no_inertia_about_itself_and_is_sound(
    added: float, origin: float
) -> None:
    """Nothing turns about it: it is a body, also far from the origin and in water."""
    solid = scaled(strip(10, tip_mass=0.0, turning=False), [1.0, added, added])
    body = FeModel("strip", solid.x + [0.0, origin, 0.0], solid.M, solid.K, None)
    refuse_unsound(body)
    found = check_model(body)
    assert found.problems == [] and abs(found.rigid.inertia_about_com[0, 0]) < 1e-9
