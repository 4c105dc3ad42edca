"""Play in the gears of whole arms: machine code and NumPy agree, and without play nothing has changed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from geared_arm import OMEGA, PLAY, geared_arm
from test_plant_energy import energy, without_losses

from flexarm_bringup.sim.backlash import Gaps, find_gears, gaps_of, rest_at_home, steps_for_teeth
from flexarm_bringup.sim.implicit_period import MachinePeriod, PlainPeriod, Stepping, make_period
from flexarm_bringup.sim.perturb import PlantSettings, perturb
from flexarm_bringup.sim.plant import Plant, choose_steps
from flexarm_bringup.sim.rig import Rig, RigSettings
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.numeric.compiled import find_compiler
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.settings.strict_yaml import ConfigError
from flexarm_model.tree.reduced_tree import ReducedTree

ARCMIN = np.pi / 10800  # rad


def with_play(config: ManipulatorConfig, joint: str, play: float) -> ManipulatorConfig:
    """Return the arm with play in every spring of a joint."""
    joints, closures = (
        tuple(
            replace(each, axes=tuple(replace(axis, backlash=play) for axis in each.axes))
            if each.name == joint
            else each
            for each in group
        )
        for group in (config.joints, config.closures)
    )
    return replace(config, joints=joints, closures=closures)


def worn(name: str) -> ReducedTree:
    """Return an arm with 5 arcmin, or, where it has no gears, with play in the joint that constrains it."""
    config = load_config(find_manipulator(name))
    if name == "spatial_3tpt":
        return ReducedTree(with_play(config, "constraint", 5 * ARCMIN))
    return ReducedTree(perturb(config, PlantSettings(extra_modes=0, backlash=5 * ARCMIN)))


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
@pytest.mark.parametrize("is_driven", [True, False])
@pytest.mark.parametrize("name", ["serial_6r", "spatial_3tpt", "variable_stiffness"])
def test_machine_code_and_numpy_move_a_worn_arm_alike(name: str, is_driven: bool) -> None:
    """Torques that turn round take every gear to both sides of its gap."""
    tree = worn(name)
    stepping = Stepping(4e-4, 3, 0.2, is_driven, passes=2 if tree.n_c else 1)
    fast, plain, gaps = make_period(tree, stepping), PlainPeriod(tree, stepping), gaps_of(tree)
    assert isinstance(fast, MachinePeriod) and gaps.index.size >= 3
    most = np.array([axis.effort for axis in tree.config.actuated.values()]) if is_driven else 50.0
    q = rest_at_home(tree, gaps)
    a = b = (q, np.zeros_like(q), np.zeros_like(q))
    free = []
    for k in range(60):
        u = 0.5 * most * np.sign(np.sin(k / 4 + np.arange(len(tree.actuated))))
        a, b = fast.advance(*a[:2], u), plain.advance(*b[:2], u)
        for found, expected in zip(a, b, strict=True):  # rounding, as the steps enlarge it
            np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8 * abs(expected).max())
        free.append(abs(a[0][gaps.index]) < gaps.half)
    assert np.any(free) and not np.all(free)


@pytest.mark.parametrize("name", ["serial_6r", "spatial_3tpt"])
def test_a_worn_arm_stands_still_at_home_under_the_torques_that_hold_it(name: str) -> None:
    tree = worn(name)
    gaps = gaps_of(tree)
    q = rest_at_home(tree, gaps)
    period = make_period(tree, Stepping(4e-4, 3, 0.0, is_driven=False))
    end, v, _ = period.advance(q, np.zeros(tree.n_q), np.zeros(len(tree.actuated)))
    np.testing.assert_allclose(end, q, atol=1e-11)
    assert abs(tree.constraints(q)[0]).max(initial=0.0) < 1e-9
    loaded = abs(q[gaps.index]) > gaps.half
    assert loaded.any()


@pytest.mark.slow
def test_six_undamped_gears_that_hit_for_a_second_keep_their_energy() -> None:
    """In steps that follow the served modes alone it grew 100 times: light parts stand at stiff gears."""
    config = without_losses(load_config(find_manipulator("serial_6r")))
    plant = Plant(config, 1.0 / config.rate_hz, PlantSettings(extra_modes=1, backlash=ARCMIN))
    push = 0.02 * np.array([axis.effort for axis in config.actuated.values()])
    for _ in range(50):
        plant.drive(push)
    gaps = gaps_of(plant.tree)
    start, engaged = energy_with_play(plant, gaps), []
    for _ in range(500):
        plant.drive(0 * push)
        engaged.append(abs(plant.q[gaps.index]) > gaps.half)
    assert np.all(np.abs(np.diff(engaged, axis=0)).sum(axis=0) > 10)  # each met its teeth and left them
    assert energy_with_play(plant, gaps) == pytest.approx(start, rel=5e-3)


def energy_with_play(plant: Plant, gaps: Gaps) -> float:
    """Return the kinetic and elastic energy [J], that of the teeth instead of whole springs."""
    delta = plant.q[gaps.index]
    depth = np.maximum(abs(delta) - gaps.half, 0.0)
    return energy(plant) + float(gaps.stiffness @ (depth**2 - delta**2)) / 2


def test_teeth_ask_for_short_steps_and_arms_without_play_for_none() -> None:
    config = load_config(find_manipulator("serial_6r"))
    arms = (perturb(config, PlantSettings(backlash=play)) for play in (0.0, ARCMIN))
    sound, loose = (ReducedTree(arm, use_compiler=False) for arm in arms)  # nothing is moved
    few, many = (choose_steps(tree, 2e-3, 0.0).substeps for tree in (sound, loose))
    assert steps_for_teeth(sound, 2e-3) == 1
    assert many == steps_for_teeth(loose, 2e-3) > 4 * few


def test_steps_follow_the_oscillation_of_two_inertias_on_their_teeth(tmp_path: Path) -> None:
    tree = ReducedTree(geared_arm(tmp_path))
    assert steps_for_teeth(tree, 9.99 / OMEGA) == 10  # the lever alone would turn by 8.5 rad
    assert steps_for_teeth(tree, 10.1 / OMEGA) == 11


def test_the_gears_of_an_arm_are_the_springs_along_its_motors() -> None:
    """The bearings of the 6R bend about two more axes, and shift; they have no play."""
    gears = {f"bearing_{i}.{axis}" for i, axis in enumerate(("rz", "ry", "ry", "rx", "ry", "rx"), start=1)}
    assert find_gears(load_config(find_manipulator("serial_6r"))) == gears
    springs = {"base_spring.ry", "shoulder_spring.rz", "elbow_spring.rz"}
    assert find_gears(load_config(find_manipulator("variable_stiffness"))) == springs
    for name in ("single_link", "planar_3rrr", "spatial_3tpt"):
        assert not find_gears(load_config(find_manipulator(name)))


def test_a_spring_elsewhere_or_along_another_axis_is_no_gear(tmp_path: Path) -> None:
    config = geared_arm(tmp_path)
    motor, gear = config.joints
    assert find_gears(config) == {"gear.rz"}
    apart, across = np.eye(4), np.eye(4)
    apart[0, 3] = 0.1
    across[:3, :3] = [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]
    for placement in (apart, across):
        assert not find_gears(replace(config, joints=(motor, replace(gear, placement=placement))))


def test_wear_adds_to_the_play_that_is_described(tmp_path: Path) -> None:
    rig = Rig(geared_arm(tmp_path), RigSettings(backlash=1e-3))
    assert gaps_of(rig.plant.tree).half == pytest.approx([(PLAY + 1e-3) / 2])


def test_wear_of_an_arm_without_gears_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"'single_link': backlash: 0\.001: it has no gear"):
        Plant(load_config(find_manipulator("single_link")), 5e-3, PlantSettings(backlash=1e-3))


def test_models_take_the_gear_as_engaged(tmp_path: Path) -> None:
    worn_model = linearize(ReducedTree(geared_arm(tmp_path)))
    model = linearize(ReducedTree(geared_arm(tmp_path, backlash="0 rad")))
    for part in ("M", "D", "K", "B", "f0", "omega", "q0"):
        np.testing.assert_array_equal(getattr(worn_model, part), getattr(model, part))
