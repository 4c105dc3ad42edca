"""Arms without a moves file: the tour of "flexarm sim" with settings that nobody chose for them."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from small_arm import small_arm

from flexarm_bringup.sim_run.conditions import NOMINAL
from flexarm_bringup.sim_run.study import run_sim_job, sim_jobs
from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.course import plan_course
from flexarm_bringup.tasks.learned_stiffness import LEARNED, UNFELT
from flexarm_bringup.tasks.task_check import check_against_arm
from flexarm_bringup.tasks.task_for import SETTINGS, task_for, tour
from flexarm_bringup.tasks.task_moves import ByAxes, ToPose
from flexarm_controller.limits import limits_of
from flexarm_model.manipulator.description import Joint, ManipulatorConfig
from flexarm_model.motion.profiles import Trapezoid
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.tree.reduced_tree import ReducedTree

ROOT = Path(__file__).parents[3]
FLAT, UPRIGHT = ROOT / "docs" / "two_link.yaml", Path(__file__).parent / "arms" / "crane.yaml"
PAGE = ROOT / "docs" / "your_own_arm.md"
SOFT = "stiffness -20 %"
POSES = {"near": np.radians([20.0]), "far": np.radians([-40.0])}


@pytest.mark.parametrize(("path", "condition"), [(FLAT, SOFT), (UPRIGHT, NOMINAL), (UPRIGHT, SOFT)])
@pytest.mark.slow
def test_an_arm_that_is_softer_than_described_tours_its_poses_and_rests_where_it_ends(
    path: Path, condition: str
) -> None:
    (job,) = sim_jobs(task_for(str(path)), [""], [condition])
    (mpc,) = run_sim_job(replace(job, laws=("mpc",)))
    assert mpc.effort.guard == ""
    assert mpc.effort.unusable < 0.01  # state lost: without states for where it rests 68 % of the periods
    assert max(leg.residual.distance for leg in mpc.legs) < 2e-3  # m, RMS; it swung by half a metre


def with_first_axis(config: ManipulatorConfig, **changes: float) -> ManipulatorConfig:
    name = next(iter(config.actuated))

    def change(joint: Joint) -> Joint:
        axes = (replace(a, **changes) if f"{joint.name}.{a.name}" == name else a for a in joint.axes)
        return replace(joint, axes=tuple(axes))

    return replace(config, joints=tuple(map(change, config.joints)))


@pytest.mark.parametrize("name", [str(FLAT), str(UPRIGHT), "single_link", "planar_3rrr", "serial_6r"])
def test_an_arm_that_can_do_the_tour_has_it_as_ever(name: str) -> None:
    config = load_config(find_manipulator(name))
    told = tour(name, config)
    profile = Trapezoid(1.0, 1.0, 0.05, 0.05)
    first = next(iter(config.actuated))
    named = {f"to {pose}": ToPose(pose, profile) for pose in config.poses}
    assert told.moves == {
        **(named or {"out": ByAxes({first: np.radians(20.0)}, profile)}),
        "home": ToPose("home", profile),
    }
    assert told.assumed[0].endswith(", 1 s a move")


@pytest.mark.parametrize(
    ("has_poses", "home_deg", "limits", "first_way_deg"),
    [
        (True, 0.0, {"velocity": 0.05}, None),  # rad/s: the poses are 20 deg away and more
        (False, 0.0, {"velocity": 0.05}, 20.0),
        (False, 160.0, {}, -20.0),  # of 170 deg
        (False, 0.0, {"lower": np.radians(-10.0), "upper": np.radians(15.0)}, 12.0),
        (False, 0.0, {"lower": np.radians(-15.0), "upper": np.radians(10.0)}, -12.0),
    ],
)
def test_a_tour_keeps_within_the_positions_and_velocities_of_the_arm(
    has_poses: bool, home_deg: float, limits: dict[str, float], first_way_deg: float | None
) -> None:
    described = load_config(find_manipulator("single_link"), "geared")
    config = with_first_axis(described, **limits)
    config = replace(config, home=np.radians([home_deg]), poses=POSES if has_poses else {})
    task = tour("short", config)
    course = plan_course(StaticArm(ReducedTree(config, use_compiler=False)), task, 0.005)
    assert course.reference.fault(limits_of(config)) == ""
    for leg in course.legs:
        begin, end = (course.reference.position(t) for t in (leg.start, leg.end))
        assert abs(end - begin).max() > np.radians(5.0)  # it does move
    if first_way_deg is not None:
        first = course.reference.position(course.legs[0].end) - np.radians(home_deg)
        np.testing.assert_allclose(first, np.radians([first_way_deg]))
    assert ("so that no axis is too fast" in task.assumed[0]) == ("velocity" in limits)


def test_the_tour_of_a_slow_arm_looks_no_higher_than_its_samples_tell(tmp_path: Path) -> None:
    for rate, highest in (("100 Hz", 45.0), ("200 Hz", 50.0)):
        arm = small_arm(tmp_path, served__rate=rate)
        task = task_for(str(arm))
        assert task.watch.cutoff_hz == pytest.approx(highest)
        check_against_arm(task)  # what a moves file with these words must pass


def test_the_moves_file_of_the_page_has_the_settings_of_the_tour(tmp_path: Path) -> None:
    blocks = re.findall(r"```yaml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    (text,) = [block for block in blocks if "flexarm-moves/1" in block]
    path = tmp_path / "moves.yaml"
    path.write_text(text.replace("manipulator: docs/two_link.yaml", f"manipulator: {FLAT}"), encoding="utf-8")
    told = {name: values for name, values in task_for(str(path)).settings.items() if values}
    tour_of_it = task_for(str(FLAT)).settings
    assert told == {**tour_of_it, "schedule": {"angle": SETTINGS["schedule"]["angle"]}}
    known = SETTINGS["estimator"].keys() | LEARNED["estimator"].keys()
    assert tour_of_it["estimator"].keys() - known == {"acceleration_error"}


def test_how_soft_an_arm_is_is_learned_where_a_sensor_feels_it_bend(tmp_path: Path) -> None:
    """With encoders and a camera alone 35 % less stiffness was learned of their noise, and the state lost."""
    felt = task_for(str(FLAT))
    blind = re.sub(
        r"\n  (upper_strain|forearm_strain|tip_accelerometer):.*", "", FLAT.read_text(encoding="utf-8")
    )
    path = tmp_path / "blind.yaml"
    path.write_text(blind, encoding="utf-8")
    unfelt = task_for(str(path))
    assert felt.settings["estimator"]["stiffness_modes"] > 0 and "stiffness_step" in felt.settings["mpc"]
    assert "stiffness_modes" not in unfelt.settings["estimator"]
    assert "stiffness_step" not in unfelt.settings["mpc"]
    assert unfelt.assumed[-1] == UNFELT


def test_an_arm_that_hangs_learns_by_which_share_it_hangs_lower() -> None:
    flat, upright = (task_for(str(path)).settings["estimator"] for path in (FLAT, UPRIGHT))
    assert "sag_share" not in flat
    assert upright["sag_share"] > 0.0 and upright["sag_error"] < flat["sag_error"]
