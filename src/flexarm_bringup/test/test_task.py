"""Task files: what they say, what they refuse, and the motion that comes out."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.course import plan_course
from flexarm_bringup.tasks.task import find_task, load_task
from flexarm_bringup.tasks.task_for import task_for, tour
from flexarm_controller.settings import MpcConfig
from flexarm_model.reading.config import load_config
from flexarm_model.settings.strict_yaml import ConfigError
from flexarm_model.tree.reduced_tree import ReducedTree

ARM = """
format: flexarm/1
name: elbow
source: made up for the tests
gravity: [0 m/s^2, 0 m/s^2, -9.81 m/s^2]
bodies:
  upper: {type: rigid, mass: 1 kg, com: [0.2 m, 0 m, 0 m], nodes: {end: [0.4 m, 0 m, 0 m]}}
  fore: {type: rigid, mass: 1 kg, com: [0.15 m, 0 m, 0 m], nodes: {end: [0.3 m, 0 m, 0 m]}}
  hand: {type: rigid, mass: 100 g, com: [0 m, 0 m, 0 m], nodes: {tool: [0 m, 0 m, 0 m]}}
joints:
  shoulder: {parent: world, child: upper.root, axes: {ry: {actuated: true, lower: -180 deg, upper: 180 deg}}}
  elbow: {parent: upper.end, child: fore.root, axes: {ry: {actuated: true, lower: -180 deg, upper: 180 deg}}}
  lift: {parent: fore.end, child: hand.root, axes: {ty: {actuated: true, lower: -1 m, upper: 1 m}}}
tip: hand.tool
served: {modes: 0, home: [-60 deg, 90 deg, 0 mm], rate: 200 Hz, poses: {B: [-30 deg, 80 deg, 20 mm]}}
"""

TASK = """
format: flexarm-moves/1
wait: 0.5 s
watch: {from: 50 ms, to: 0.4 s, below: 30 Hz, tolerance: 0.1 mm}
moves:
  bend: {by: {elbow.ry: 20 deg, lift.ty: 10 mm}, duration: 0.5 s}
  B: {to: B, duration: 1 s, ramps: [0.3 s, 0.2 s]}
  along: {shift: [0 mm, 30 mm, -40 mm], duration: 0.4 s}
settings:
  mpc: {horizon: 20, blocks: [2, 2, 4, 6, 6]}
  schedule: {angle: 0.1}
"""


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> StaticArm:
    path = tmp_path_factory.mktemp("arm") / "elbow.yaml"
    path.write_text(ARM, encoding="utf-8")
    return StaticArm(ReducedTree(load_config(path), use_compiler=False))


def write(folder: Path, text: str) -> Path:
    (folder / "elbow.yaml").write_text(text, encoding="utf-8")
    return folder / "elbow.yaml"


def test_the_reference_goes_through_every_move_and_ends_at_rest(arm: StaticArm, tmp_path: Path) -> None:
    task = load_task(write(tmp_path, TASK))
    course = plan_course(arm, task, 0.005)
    assert [leg.name for leg in course.legs] == ["bend", "B", "along"]
    assert [round(leg.end - leg.start, 9) for leg in course.legs] == [0.5, 1.0, 0.4]
    theta, rate, _ = course.reference.sample(np.array([leg.end + 0.01 for leg in course.legs]))
    bent = arm.named_pose("home") + [0.0, np.radians(20.0), 0.01]
    assert theta[0] == pytest.approx(bent) and theta[1] == pytest.approx(arm.named_pose("B"))
    assert rate == pytest.approx(np.zeros((3, 3)))
    assert course.end == pytest.approx(0.5 + 0.5 + 1.0 + 0.4 + 3 * 0.5)


def test_between_two_moves_nothing_moves(arm: StaticArm, tmp_path: Path) -> None:
    course = plan_course(arm, load_task(write(tmp_path, TASK)), 0.005)
    pause = np.linspace(course.legs[0].end + 1e-3, course.legs[1].start - 1e-3, 50)
    theta, rate, acceleration = course.reference.sample(pause)
    assert np.ptp(theta, axis=0) == pytest.approx(np.zeros(3), abs=1e-12)
    assert not rate.any() and not acceleration.any()


def test_a_shift_moves_the_tip_along_a_straight_line(arm: StaticArm, tmp_path: Path) -> None:
    course = plan_course(arm, load_task(write(tmp_path, TASK)), 0.005)
    leg = course.legs[-1]
    t = np.linspace(leg.start, leg.end, 101)
    tip = np.array([arm.pose(theta)[:3, 3] for theta in course.reference.sample(t)[0]])
    assert tip[-1] - tip[0] == pytest.approx([0.0, 0.03, -0.04], abs=1e-6)
    off = np.cross(tip - tip[0], np.array([0.0, 0.6, -0.8]))
    assert abs(off).max() < 1e-6  # a quintic through points 10 ms apart
    rates = np.gradient(course.reference.sample(t)[0], t, axis=0, edge_order=2)
    assert course.reference.sample(t)[1] == pytest.approx(rates, abs=0.02 * abs(rates).max())


def test_settings_are_those_of_the_classes_with_the_files_values(tmp_path: Path) -> None:
    mpc = load_task(write(tmp_path, TASK)).make("mpc", MpcConfig)
    assert mpc.horizon == 20 and mpc.blocks == (2, 2, 4, 6, 6)
    assert mpc.position_error == MpcConfig().position_error


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("horizon: 20", "horizont: 20", "settings.mpc.horizont"),
        ("to: B,", "to: B, by: {elbow.ry: 1 deg},", "exactly one of by, to, shift, square"),
        ("elbow.ry: 20 deg", "elbow.ry: 20 mm", "angle"),
        ("ramps: [0.3 s, 0.2 s]", "ramps: [0.9 s, 0.2 s]", "t_a"),
        ("below: 30 Hz, ", "", "watch.below"),
    ],
)
def test_a_wrong_file_is_refused_by_name(tmp_path: Path, old: str, new: str, words: str) -> None:
    with pytest.raises(ConfigError, match=words):
        load_task(write(tmp_path, TASK.replace(old, new)))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("to: B,", "to: C,", "no pose 'C'"),
        ("lift.ty", "lift.tz", "no such axis"),
        ("-40 mm", "-4000 mm", "along"),
    ],
)
def test_what_the_arm_cannot_do_is_refused_by_the_moves_name(
    arm: StaticArm, tmp_path: Path, old: str, new: str, words: str
) -> None:
    with pytest.raises(ValueError, match=words):
        plan_course(arm, load_task(write(tmp_path, TASK.replace(old, new))), 0.005)


def test_a_pose_where_loops_do_not_close_is_refused_by_the_moves_name() -> None:
    config = load_config(Path(__file__).parents[2] / "flexarm_model/test/arms/five_bar.yaml")
    config = replace(config, poses={"apart": np.array([3.3, 0.2])})
    arm = StaticArm(ReducedTree(config, use_compiler=False))
    with pytest.raises(
        ConfigError, match=r"move 'to apart': five_bar: pose 'apart' \[3.3, 0.2\]: .* do not close"
    ):
        plan_course(arm, tour("five_bar", config), 0.005)


def test_the_tasks_that_come_along_can_be_read() -> None:
    folder = find_task("single_link").parent
    assert all(load_task(path).moves for path in sorted(folder.glob("*.yaml")))


def test_a_copy_of_one_that_comes_along_is_of_the_same_arm(tmp_path: Path) -> None:
    for path in sorted(find_task("single_link").parent.glob("*.yaml")):
        copy = tmp_path / f"my_{path.name}"
        copy.write_bytes(path.read_bytes())
        assert load_task(copy).manipulator == path.stem


def test_a_file_that_names_no_arm_and_is_named_after_none_is_told_so_once(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="of the arm it is named after") as refused:
        task_for(str(write(tmp_path, TASK)))
    assert str(refused.value).count("manipulator: ") == 1


def test_preset_changes_the_settings_that_it_names_and_no_others(tmp_path: Path) -> None:
    own = "preset_settings:\n  light: {mpc: {input_jerk: 50.0}, schedule: {angle: 0.2}}\n"
    task = load_task(write(tmp_path, TASK + own))
    light, plain = task.under("light"), task.under("")
    assert (light.make("mpc", MpcConfig).input_jerk, light.make("mpc", MpcConfig).horizon) == (50.0, 20)
    assert light.settings["schedule"]["angle"] == 0.2
    assert plain.make("mpc", MpcConfig) == task.make("mpc", MpcConfig)
    assert plain.settings["schedule"]["angle"] == 0.1


def test_wrong_setting_of_a_preset_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="weight"):
        load_task(write(tmp_path, TASK + "preset_settings:\n  light: {mpc: {weight: 1.0}}\n"))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("wait: 0.5 s", "wait: 1000000 s", "wait: '1000000 s': must be below 3600"),
        ("wait: 0.5 s", "wait: 0.5 s\nlead: 3601 s", "lead: '3601 s': must be below 3600"),
        ("duration: 0.5 s", "duration: 100000 s", "moves.bend: '100000 s': may take 3600 s at most"),
    ],
)
def test_what_takes_longer_than_an_hour_is_refused(old: str, new: str, words: str, tmp_path: Path) -> None:
    """One wrong unit, and the machine had no memory left."""
    assert old in TASK
    with pytest.raises(ConfigError, match=words):
        load_task(write(tmp_path, TASK.replace(old, new)))


def test_an_axis_that_is_too_slow_for_a_tour_is_named(tmp_path: Path) -> None:
    path = tmp_path / "arm.yaml"
    path.write_text(ARM.replace("lower: -1 m, upper: 1 m", "lower: -1 m, upper: 1 m, velocity: 1 um/s"))
    with pytest.raises(ConfigError, match=r"velocity of lift.ty, 1e-06 SI, .* at most 3600 s are allowed"):
        task_for(str(path))


@pytest.mark.parametrize(
    ("move", "words"),
    [
        (
            "shift: [2 m, 0 m, 0 m]",
            r"moves\.far: the tip cannot follow its way from 0\.1\d+ m on, 0\.\d+ s after",
        ),
        (
            "shift: [20 mm, 0 m, 0 m], keep_orientation: true",
            r"from [\d.e-]+ m on, .*; with so few axes, 2, only",
        ),
    ],
)
def test_a_way_that_cannot_be_gone_is_refused_with_where_it_ends(
    move: str, words: str, tmp_path: Path
) -> None:
    """ "2.7e-07 m left" was what the first sample beyond reach missed: a tolerance too tight, it seemed."""
    arm = Path(__file__).parents[3] / "docs" / "two_link.yaml"
    path = tmp_path / "moves.yaml"
    path.write_text(
        f"format: flexarm-moves/1\nmanipulator: {arm}\nwait: 2.5 s\n"
        "watch: {from: 0.1 s, to: 2.1 s, below: 20 Hz, tolerance: 0.5 mm}\n"
        f"moves:\n  far: {{{move}, duration: 3 s}}\n",
        encoding="utf-8",
    )
    with pytest.raises(ValueError, match=words):
        plan_course(StaticArm(ReducedTree(load_config(arm), use_compiler=False)), load_task(path), 0.005)


def test_a_torque_that_the_filter_tells_is_not_planned_a_second_time(tmp_path: Path) -> None:
    """Axes were off by 26 mrad instead of 5, and nobody said why."""
    text = find_task("variable_stiffness").read_text(encoding="utf-8")
    assert "filter: corrected" in text and "arm_torque: true" in text
    path = tmp_path / "twice.yaml"
    path.write_text(text.replace("filter: corrected", "filter: linear"), encoding="utf-8")
    with pytest.raises(ConfigError, match=r"twice.yaml: settings.mpc.arm_torque: True: expected false with"):
        load_task(path)
