"""Seed 004 reproduced: golden numbers of its notes, its printed columns, and an honest page."""

from __future__ import annotations

import contextlib
import io
import json
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from flexarm_bringup import cli
from flexarm_bringup.reproduce import seed_004_matrices, seed_004_photographs
from flexarm_bringup.reproduce.reference import read_records
from flexarm_bringup.reproduce.seed_004 import stiffness_lines
from flexarm_bringup.reproduce.seed_004_data import (
    COPIED_SAMPLE,
    MANIPULATOR,
    arm_config,
    elbow_arm,
    find_moving_angle,
    place_tips,
    read_film,
    read_photographs,
)
from flexarm_bringup.reproduce.seed_004_film import NOTED_SPEED, Filmed, implied_speeds, run_all, skill_table
from flexarm_bringup.reproduce.seed_004_matrices import RigidLinks, mode_checks, mode_table
from flexarm_bringup.reproduce.seed_004_parameters import frame_check, parameter_table
from flexarm_bringup.reproduce.seed_004_photographs import fit_lengths
from flexarm_bringup.reproduce.seed_004_printed import (
    appendix_block,
    intended_block,
    literal_gravity,
    literal_inverse,
)
from flexarm_bringup.share import share_path
from flexarm_model.reading.config import load_config

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Written:
    """What the command left behind."""

    code: int
    text: str
    content: dict[str, Any]
    html: str


@pytest.fixture(scope="module")
def arm() -> RigidLinks:
    return RigidLinks(arm_config())


@pytest.fixture(scope="module")
def filmed() -> Filmed:
    return run_all()


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Written:
    """Run the command once, with everything it can write."""
    files = [tmp_path_factory.mktemp("seed_004") / name for name in ("a.json", "a.html")]
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        code = cli.main(["reproduce", "004", "--json", str(files[0]), "--html", str(files[1])])
    return Written(code, text.getvalue(), json.loads(files[0].read_text()), files[1].read_text())


def test_modes_and_damping_under_both_units_are_golden() -> None:
    rows = {str(row[0]): row for row in mode_table().rows}
    found = {unit: [[float(x) for x in str(cell).split("/")] for cell in rows[unit][3:5]] for unit in rows}
    np.testing.assert_allclose(found["deg"][0], [8.74, 8.75, 41.5])
    np.testing.assert_allclose(found["rad"][0], [1.16, 1.16, 5.5], rtol=5e-3)  # half the last of two digits
    np.testing.assert_allclose(found["deg"][1], [0.38, 0.39, 1.21], atol=0.005)
    np.testing.assert_allclose(found["rad"][1], [2.8, 2.9, 9.2], atol=0.05)
    assert [rows[unit][5] for unit in ("deg", "rad")] == pytest.approx([0.54, 31.0], rel=0.005)
    assert [rows[unit][6] for unit in ("deg", "rad")] == [True, False]


def test_printed_errors_are_the_difference_of_the_printed_columns() -> None:
    wrong = set()
    for name, row in read_records("seed004_table3").items():
        for axis in "xyz":
            cells = [row[f"{key}_{axis}_mm"] for key in ("exp", "th", "err")]
            if all(cells):
                measured, theory, error = map(float, cells)
                if abs(abs(measured - theory) - error) > 0.0151:  # the paper cuts some at the second digit
                    wrong.add(name)
    assert wrong == {"4", "26"}  # misprints that the notes name


def test_the_calibrated_preset_is_the_fit_on_all_poses() -> None:
    photos = read_photographs()
    fitted = fit_lengths(photos, np.full(len(photos.names), True))
    preset = elbow_arm(arm_config("calibrated"))
    for wanted, found in zip(vars(preset).values(), vars(fitted).values(), strict=True):
        assert found == pytest.approx(wanted, abs=0.05e-3)


def test_lengths_are_found_again_on_exact_tips() -> None:
    photos = read_photographs()
    exact = place_tips(elbow_arm(arm_config()), photos.restored_deg)
    seen = np.where(np.isnan(photos.measured), np.nan, exact)
    fitted = fit_lengths(replace(photos, measured=seen), np.full(len(photos.names), True))
    np.testing.assert_allclose(list(vars(fitted).values()), [0.04, 0.29, 0.24], atol=1e-12)


def test_the_film_has_25_samples_and_its_angles_place_its_tips() -> None:
    film, geometry = read_film(), elbow_arm(arm_config())
    assert COPIED_SAMPLE not in film.names and len(film.names) == 25
    for joint, standing in ((1, (0.0, np.nan, 0.0)), (2, (0.0, 15.9, np.nan)), (0, (np.nan, 15.9, -44.975))):
        rows = film.joint == joint
        angle = find_moving_angle(film, geometry, film.theory)[rows]
        q = np.where(np.isnan(standing), angle[:, None], standing)
        off = np.abs(place_tips(geometry, q) - film.theory[rows])[film.seen[rows]]
        assert off.max() <= 0.01  # mm, one unit of the last printed digit


def test_the_rigid_null_is_in_the_next_row(filmed: Filmed) -> None:
    rows = skill_table(filmed)[0].rows
    names = [str(row[0]) for row in rows]
    springs = next(i for i, name in enumerate(names) if name.startswith("spring-damper, N m/deg"))
    assert names[springs + 1].startswith("null: rigid arm, same ramps")
    np.testing.assert_allclose(
        np.array(rows[0][4:], dtype=float), [0.81, 1.39, 0.26, 4.0, 2.3, 5.7], atol=0.05
    )
    late = np.array(rows[springs + 2][1:], dtype=float)
    np.testing.assert_allclose(late, [0.27, 0.55, 0.19, 0.81, 1.25, 0.24, 4.0, 2.2, 5.5], atol=0.06)


def test_the_speed_of_the_notes_comes_of_the_misprinted_sample() -> None:
    assert implied_speeds(read_film()) == pytest.approx([-48.21, -48.98, -29.05], abs=0.005)
    assert implied_speeds(read_film(as_printed=True))[0] == pytest.approx(NOTED_SPEED, abs=0.005)


def test_ramps_fitted_to_the_camera_are_golden(filmed: Filmed) -> None:
    ramps = filmed.runs["camera"].ramps
    assert [ramp.rate for ramp in ramps] == pytest.approx([47.0, 51.6, 34.5], abs=0.05)
    assert [ramp.start for ramp in ramps] == pytest.approx([7.133, 1.092, 3.945], abs=0.002)


def test_the_printed_appendix_is_not_positive_definite() -> None:
    assert np.linalg.eigvals(appendix_block(0.0)).real.min() == pytest.approx(-0.008, abs=5e-4)


def test_printed_arms_are_too_long_and_printed_gravity_too_large(arm: RigidLinks) -> None:
    q = np.radians([0.0, 16.0, 0.0])
    too_large = np.diag(intended_block(0.0)) / np.diag(arm.mass_matrix(q))[1:]
    np.testing.assert_allclose(too_large, [3.3, 6.7], atol=0.05)
    np.testing.assert_allclose(literal_gravity(q), [1.325, 0.334], atol=5e-4)


def test_the_printed_inverse_fails_in_eight_poses() -> None:
    over, distance = literal_inverse(read_photographs())
    assert over == 8
    assert distance == pytest.approx(381.0, rel=0.01)


def test_every_column_of_a_table_has_a_name_of_its_own_in_json(written: Written) -> None:
    names = [name for table in written.content["tables"] for name in table["columns"]]
    assert [name for name in names if not name or name != name.strip() or "(2)" in name] == []


def test_every_bound_is_met(written: Written) -> None:
    assert written.code == 0 and written.content["passed"] is True
    assert [check["name"] for check in written.content["checks"] if not check["passed"]] == []
    assert len(written.content["checks"]) == 21


@pytest.mark.parametrize(
    ("key", "value", "missed"),
    [
        ("bodies.link_2.nodes.shoulder.0", "-291 mm", "lengths"),
        ("bodies.link_3.mass", "147.6 g", "masses"),
        ("bodies.link_1.com.2", "24.6 mm", "centres of mass"),
        ("bodies.link_2.inertia.0", "0.00003825 kg m^2", "moments of inertia"),
        ("joints.elbow_spring.axes.rz.damping", "1.4 N m s/rad", "k and c"),
        ("joints.base_spring.axes.ry.stiffness.values.1", "1.7 N m/deg", "k and c"),
    ],
)
def test_a_parameter_that_is_not_the_papers_misses_its_bound(key: str, value: str, missed: str) -> None:
    arm = RigidLinks(load_config(share_path(MANIPULATOR), changes={key: value}))
    _, checks = parameter_table(arm)
    assert f"table 2: {missed}" in [check.name for check in checks if not check.passed]
    says_paper = "k, c: paper's value," in stiffness_lines(arm)[1]
    assert says_paper == (missed != "k and c")


def test_a_link_of_another_length_is_not_where_the_papers_table_1_has_it() -> None:
    assert frame_check(RigidLinks(arm_config())).passed
    assert not frame_check(RigidLinks(arm_config("table_3"))).passed


def test_modes_of_another_stiffness_miss_their_bound(monkeypatch: pytest.MonkeyPatch) -> None:
    assert all(check.passed for check in mode_checks())
    monkeypatch.setitem(seed_004_matrices.MODE_CASES, "deg", "soft")
    assert [check.passed for check in mode_checks()] == [False, True]


def test_units_and_what_is_inferred_are_said(written: Written) -> None:
    assert written.content["stiffness_unit"] == "deg"
    assert "stiffness_unit = deg: k = 1.66 N m/deg = 95.1 N m/rad" in written.text
    assert "k, c: paper's value, unit assumed; ramps and start times inferred" in written.text
    assert "only 2 bar was tested" in written.text
    assert all(head in written.text for head in ("Fitted", "Assumed", "Not claimed", "Errors and misprints"))


def test_the_page_has_every_table_and_plot(written: Written) -> None:
    assert len(written.content["tables"]) == 9
    assert written.html.count("<svg") == 3
    assert "Table 3 recomputed" in written.text


def test_a_missed_bound_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(seed_004_photographs, "LEFT_OUT_BOUND", 0.9)
    (check,) = seed_004_photographs.skill_table(read_photographs())[1]
    assert not check.passed
