"""Seed 000 reproduced: golden numbers of its notes from two formulations, and honest exit codes."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

from flexarm_bringup import cli
from flexarm_bringup.page.report import Page
from flexarm_bringup.reproduce import seed_000, seed_000_frequencies
from flexarm_bringup.reproduce.seed_000_data import (
    Published,
    Served,
    actuated_pose,
    ema_error_percent,
    frame_hz,
    load,
    read_published,
    serve,
)
from flexarm_bringup.reproduce.seed_000_frame import build_frame, element_matrices
from flexarm_bringup.reproduce.seed_000_materials import material_table
from flexarm_bringup.reproduce.seed_000_modal_test import (
    GOLDEN_FRF,
    LINES_HZ,
    RATIO,
    TIMES,
    ModalTest,
    frame_modes,
    frame_response,
    run_modal_test,
)
from flexarm_bringup.reproduce.seed_000_numerics import GOLDEN_HZ
from flexarm_bringup.reproduce.seed_000_rig import POSES, RIG, Rig, place_legs
from flexarm_bringup.share import share_path
from flexarm_model.kinematics.planar_legs import PlanarLegs
from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import find_equilibrium

Capture = pytest.CaptureFixture[str]

GOLDEN_ELBOWS = {  # seed 000, section 4 [m]
    "A": [(0.2633, 0.1913), (-0.3852, 0.1338), (0.1122, -0.4409)],
    "B": [(0.3325, 0.3519), (-0.3566, 0.1358), (0.0341, -0.3239)],
}
GOLDEN_ANGLES = {  # links 1, links 2 [deg]
    "A": [(-38.40, 96.63, -134.19), (-158.84, -46.51, 99.99)],
    "B": [(-8.24, 91.74, -158.36), (-147.23, -25.73, 69.11)],
}
NEXT_MODES_HZ = [54.90, 55.32, 55.47, 64.53, 64.74, 65.06, 123.90]  # pose A, after the ninth
SENSITIVITY = [  # change of +10 %, modes, effect [%], and half its last printed digit
    ("elbow_mass", slice(0, 3), [-1.1, -1.5, -2.0], 0.05),
    ("platform_mass platform_inertia", slice(0, 3), [-1.7, -1.1, -0.6], 0.05),  # same radius of gyration
    ("half_body", slice(3, 6), [-2.0, -2.0, -2.0], 0.5),
    ("half_body", slice(6, 9), [-1.05, -1.05, -1.05], 0.05),
]


@pytest.fixture(scope="module")
def published() -> Published:
    return read_published()


@pytest.fixture(scope="module")
def served() -> Served:
    return serve(load())


@pytest.fixture(scope="module")
def modal_test() -> ModalTest:
    return run_modal_test()


@pytest.fixture(scope="module")
def page() -> Page:
    return seed_000.main()


@pytest.mark.parametrize("pose", POSES)
def test_the_plane_frame_has_the_golden_frequencies(pose: str) -> None:
    np.testing.assert_allclose(frame_hz(pose), GOLDEN_HZ[pose], rtol=1e-4)  # four printed decimals


@pytest.mark.parametrize("pose", POSES)
def test_nine_served_modes_are_the_frames(pose: str, served: Served) -> None:
    np.testing.assert_allclose(served.f_hz(pose), frame_hz(pose), rtol=1e-3)
    assert served.f_hz(pose)[8] > frame_hz(pose)[8] * 1.0002  # a reduction is stiffer, never equal


def test_the_next_planar_modes_are_golden() -> None:
    found = build_frame(RIG, POSES["A"]).frequencies(16)[9:]
    np.testing.assert_allclose(found, NEXT_MODES_HZ, atol=0.0051)


def test_the_frame_has_the_stated_size() -> None:
    sizes = [build_frame(RIG, POSES["A"], n).M.shape[0] for n in (1, 4, 8)]
    assert sizes == [18, 72, 144]


def test_elements_carry_their_mass_and_bend_as_the_textbook_says() -> None:
    h = 0.05
    mass, stiffness = element_matrices(RIG.first, h)
    motions = np.array(
        [[1, 0, 0, 1, 0, 0], [0, 1, 0, 0, 1, 0], [0, 0, 1, 0, h, 1]], dtype=float
    )  # rigid ones
    total = RIG.first.density * RIG.first.area * h
    np.testing.assert_allclose(np.diag(motions @ mass @ motions.T), [total, total, total * h**2 / 3])
    assert abs(stiffness @ motions.T).max() < 1e-12 * abs(stiffness).max()
    tip = np.linalg.solve(stiffness[3:, 3:], [1.0, 1.0, 0.0])  # pulled and pushed across, clamped at the root
    EA, EI = RIG.first.E * RIG.first.area, RIG.first.EI
    np.testing.assert_allclose(tip, [h / EA, h**3 / (3 * EI), h**2 / (2 * EI)])


@pytest.mark.parametrize("pose", ["A", "B"])
def test_elbows_and_link_angles_are_golden(pose: str) -> None:
    legs = place_legs(RIG, POSES[pose])
    np.testing.assert_allclose([leg.elbow for leg in legs], GOLDEN_ELBOWS[pose], atol=0.6e-4)
    angles = np.degrees([leg.angles for leg in legs]).T
    np.testing.assert_allclose(angles, GOLDEN_ANGLES[pose], atol=0.0051)


@pytest.mark.parametrize("key", ["youngs_modulus", "density"])
def test_a_strip_of_another_material_than_printed_misses_the_bound(key: str) -> None:
    value = {"youngs_modulus": "210 GPa", "density": "7850 kg/m^3"}[key]
    changed = load_config(
        share_path("config/manipulators/planar_3rrr.yaml"),
        changes={f"bodies.second_3.pieces.1.{key}": value},
    )
    assert material_table(load())[1][0].passed
    (check,) = material_table(changed)[1]
    assert not check.passed and check.found.startswith("second_3 ")


@pytest.mark.parametrize("pose", POSES)
def test_motor_angles_of_the_description_are_those_of_the_closed_form(pose: str) -> None:
    config = load()
    legs = PlanarLegs.regular((0.400, 0.120), RIG.azimuths, (0.336, 0.336), bend=-1)
    first = legs.angles(np.array(POSES[pose])).first
    zero = np.radians([270.0, 30.0, 150.0])  # towards the centre
    off = (first - zero - actuated_pose(config, pose) + np.pi) % (2 * np.pi) - np.pi
    assert abs(np.degrees(off)).max() < 1e-6  # printed digits


@pytest.mark.parametrize("pose", POSES)
def test_the_loops_close_where_the_pose_says(pose: str, served: Served) -> None:
    q, _ = find_equilibrium(served.tree, actuated_pose(served.tree.config, pose))
    T = served.tree.tip_pose(q)
    np.testing.assert_allclose(T[:2, 3], POSES[pose][:2], atol=2e-8)  # six digits of a degree
    np.testing.assert_allclose(T[:3, :3], np.eye(3), atol=1e-7)


def test_the_symmetric_pose_has_double_modes(served: Served) -> None:
    for f_hz, rounding in ((np.array(frame_hz("centre")), 1e-6), (served.f_hz("centre"), 1e-8)):
        np.testing.assert_allclose(f_hz[[0, 4, 6]], f_hz[[1, 5, 7]], rtol=rounding)


def test_only_the_difference_of_the_radii_and_the_radius_of_gyration_act() -> None:
    other = replace(
        RIG, base_radius=0.480, platform_radius=0.200, platform_inertia=1.22e-3 * (0.2 / 0.12) ** 2
    )
    found = build_frame(other, POSES["A"]).frequencies(9)
    np.testing.assert_allclose(found, frame_hz("A"), rtol=5e-7)  # axial stiffness is 1e9 times the softest
    apart = build_frame(replace(other, base_radius=0.500), POSES["A"]).frequencies(9)
    assert abs(apart / np.array(frame_hz("A")) - 1).max() > 1e-3


@pytest.mark.parametrize(("name", "modes", "effect", "digit"), SENSITIVITY)
def test_sensitivities_are_golden(name: str, modes: slice, effect: list[float], digit: float) -> None:
    changed: Rig = replace(RIG, **{key: 1.1 * getattr(RIG, key) for key in name.split()})
    found = build_frame(changed, POSES["A"]).frequencies(9) / np.array(frame_hz("A")) - 1
    np.testing.assert_allclose(100 * found[modes], effect, atol=1.2 * digit)


def test_a_pose_out_of_reach_is_refused() -> None:
    with pytest.raises(ValueError, match="cannot reach"):
        place_legs(RIG, (0.0, -0.5, 0.0))


@pytest.mark.slow
def test_the_frf_preset_has_four_modes_per_strip_with_both_ends_held() -> None:
    fine = serve(load("frf"))
    assert [body.n for body in fine.tree.bodies.values()] == [5, 5, 5, 4, 4, 4, 0]
    expected = build_frame(RIG, POSES["A"], 16).frequencies(27)
    np.testing.assert_allclose(fine.f_hz("A"), expected, rtol=5e-4)


def test_fixed_interface_frequencies_are_those_of_the_single_strips(served: Served) -> None:
    """Hinges held: the clusters at 14 and 20 Hz, out of the strips alone."""
    rows = build_frame(RIG, POSES["A"], 16)
    held = [i for leg in range(3) for i in (3 + leg * 95, 4 + leg * 95)]
    free = np.setdiff1d(np.arange(rows.M.shape[0]), [0, 1, 2, *held])
    inner = np.ix_(free, free)
    f_hz = np.sqrt(eigh(rows.K[inner], rows.M[inner], eigvals_only=True)[:6]) / (2 * np.pi)
    np.testing.assert_allclose(f_hz[:3], served.tree.bodies["second_1"].omega[0] / (2 * np.pi), rtol=1e-4)
    np.testing.assert_allclose(f_hz[3:], f_hz[3], rtol=1e-9)
    assert 13 < f_hz[0] < 14.5 and 19.5 < f_hz[3] < 20.5


def test_one_response_is_golden_to_its_printed_digits() -> None:
    frame = build_frame(RIG, POSES["A"])
    found = abs(frame_response(frame, frame_modes(frame, RATIO), np.array(list(GOLDEN_FRF))))
    np.testing.assert_allclose(found, list(GOLDEN_FRF.values()), rtol=2e-3, atol=0.6e-3)


def test_the_served_response_is_the_frames_below_thirty_hertz(modal_test: ModalTest) -> None:
    inside = LINES_HZ <= 30.0
    frame = build_frame(RIG, POSES["A"], 16)
    expected = abs(frame_response(frame, frame_modes(frame, RATIO), LINES_HZ))[inside]
    for modes, bound in ((9, 0.03), (27, 3e-3)):
        found = abs(modal_test.response(modes, "first_1.middle", "accelerometer_1.y"))[inside]
        assert np.linalg.norm(found - expected) < bound * np.linalg.norm(expected)


def test_the_cmif_puts_the_first_modes_on_the_papers_lines(
    modal_test: ModalTest, published: Published
) -> None:
    lines = [item.peak.line_hz for item in modal_test.peaks[1, "A"]]
    assert lines[:3] == [1.5625, 1.5625, 1.875]
    np.testing.assert_allclose(published.ema["A"][:3], lines[:3], atol=0.0051)


@pytest.mark.parametrize("times", TIMES)
def test_the_cmif_finds_every_mode_once(modal_test: ModalTest, times: int) -> None:
    assert [len(modal_test.peaks[times, pose]) for pose in "AB"] == [9, 9]


def test_printed_errors_divide_by_the_papers_own_frequencies(published: Published) -> None:
    for pose in "AB":
        found = ema_error_percent(published.fe[pose], published.ema[pose])
        np.testing.assert_allclose(found, published.error[pose], atol=0.0051)


def test_every_column_of_a_table_has_a_name_of_its_own_in_json(page: Page) -> None:
    names = [name for table in page.to_json()["tables"] for name in table["columns"]]
    assert [name for name in names if not name or name != name.strip() or "(2)" in name] == []


def test_every_bound_is_met(page: Page) -> None:
    assert [check.name for check in page.checks if not check.passed] == []
    assert len(page.checks) >= 25


def test_what_is_fitted_assumed_and_not_claimed_is_said(page: Page) -> None:
    text = page.to_text()
    assert all(head in text for head in ("Fitted", "Assumed", "Not claimed", "Errors and misprints"))
    assert text.count("on the nine printed FE frequencies of pose A") == 1
    for said in (
        "chosen with knowledge of pose B",
        "null predictor is nearer",
        "rotor inertia 1.21e-4",
        "mode 10",
    ):
        assert said in text


@pytest.mark.slow
def test_command_writes_json_and_a_page_with_plots(tmp_path: Path, capsys: Capture) -> None:
    files = tmp_path / "a.json", tmp_path / "a.html"
    assert cli.main(["reproduce", "000", "--json", str(files[0]), "--html", str(files[1])]) == 0
    content = json.loads(files[0].read_text())
    assert content["passed"] is True
    assert len(content["tables"]) == 9
    assert files[1].read_text().count("<svg") == 4
    assert "pose B (+5 cm, +5 cm, 0°), motors locked: predicted" in capsys.readouterr().out


def test_a_missed_bound_is_seen(
    monkeypatch: pytest.MonkeyPatch, page: Page, published: Published, served: Served
) -> None:
    monkeypatch.setitem(seed_000_frequencies.FE_BOUNDS, "B", ((1.0, 2.0, 5.0), 2.5))
    _, checks = seed_000_frequencies.pose_table("B", published, served)
    assert [check.passed for check in checks] == [False, True, True]
    assert not replace(page, checks=checks).passed  # which is exit code 1
