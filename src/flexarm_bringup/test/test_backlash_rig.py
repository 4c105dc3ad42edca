"""What play costs in the closed loop of the 6R's and the variable-stiffness arm's own moves.

./flexarm test src/flexarm_bringup/test/test_backlash_rig.py -s
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from flexarm_bringup.closed_loop import run_loop
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim_run.conditions import NOMINAL
from flexarm_bringup.sim_run.study import SimJob, Trace, judge_leg, loop_settings, observe_tip
from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.course import plan_course
from flexarm_bringup.tasks.task_for import task_for
from flexarm_estimator.estimate import Estimate
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.start_pose import starting_at
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
ARCMIN = np.pi / 10800  # rad
WAITING = 0.002  # share of the periods in which the first frame of the camera is awaited, worn or not
pytestmark = pytest.mark.slow


@dataclass(frozen=True)
class Moved:
    """What moves of a worn arm left.

    Attributes:
        residual: RMS of the tip's acceleration after the moves [m/s^2].
        off_path: Farthest that the tip was off the way [m].
        unusable: Share of the periods without a usable state [1].
        blamed: Sensors that were called faulty, all of them sound.
        stopped: Why the guard stopped the arm; empty when it did not.
    """

    residual: float
    off_path: float
    unusable: float
    blamed: frozenset[str]
    stopped: str


@cache
def moved(name: str, arcmin: float, law: str, is_told: bool, seed: int = 1) -> Moved:
    """Run the moves of an arm whose gears all have this play.

    Args:
        name: The arm.
        arcmin: Total play of every gear.
        law: Of the controller.
        is_told: The estimator expects the play in what the camera says of the tip.
        seed: Of the noise.
    """
    task, rig = task_for(name), RigSettings(backlash=arcmin * ARCMIN, seed=seed)
    config = load_config(find_manipulator(name))
    course = plan_course(StaticArm(ReducedTree(config)), task, 1 / config.rate_hz)
    config = starting_at(config, course.home)
    known = expecting_play(config, rig.backlash) if is_told else config
    settings = loop_settings(task.under(""), law, rig)
    hardware = Hardware(config, rig)
    tree = ReducedTree(known)
    blamed = set[str]()

    def observe(hardware: Hardware, estimate: Estimate) -> Mapping[str, Array]:
        blamed.update(report.name for report in estimate.sensors if report.status == "faulty")
        return observe_tip(hardware, estimate)

    ticks, effort = run_loop(hardware, tree, course.reference, course.end, settings, observe)
    t, tip, tau = (np.array([tick[key] for tick in ticks]) for key in ("t", "tip", "tau"))
    job = SimJob(task, "", NOMINAL, course)
    legs = [judge_leg(leg, Trace(t, tip, tau), job) for leg in course.legs]
    residual = float(np.sqrt(np.mean([leg.residual.acceleration**2 for leg in legs])))
    off_path = max(leg.tracking for leg in legs)
    found = Moved(residual, off_path, effort.unusable, frozenset(blamed), effort.guard)
    how = f"{law}, told" if is_told else law
    print(
        f"\n{name}, {arcmin:g} arcmin, {how}, seed {seed}: residual {found.residual:.3f} m/s^2, "
        f"off path {1e3 * found.off_path:.2f} mm, without state {100 * found.unusable:.0f} %"
    )
    return found


def expecting_play(config: ManipulatorConfig, play: float) -> ManipulatorConfig:
    """Return the arm with a camera that is trusted less: every gear is off by its play over sqrt(12)."""
    tree = ReducedTree(config)
    J = tree.tip_jacobian(linearize(tree).q0)[:, tree.actuated]
    moved_by = np.sqrt([np.mean(np.sum(rows**2, axis=1)) for rows in (J[:3], J[3:])])  # m/rad, rad/rad
    play_sigma = play / np.sqrt(12) * np.repeat(moved_by, 3)
    sensors = tuple(
        replace(spec, sigma=np.hypot(spec.sigma, play_sigma)) if spec.kind == "camera" else spec
        for spec in config.sensors
    )
    return replace(config, sensors=sensors)


def gain_db(name: str, arcmin: float, is_told: bool = False, seed: int = 1) -> float:
    """Return how much less MPC leaves than joint PD [dB]."""
    pd, mpc = (moved(name, arcmin, law, is_told, seed) for law in ("pd", "mpc"))
    assert not pd.stopped + mpc.stopped
    return float(20 * np.log10(pd.residual / mpc.residual))


def test_a_minute_of_arc_costs_the_6r_4_db_and_leaves_it_stable() -> None:
    sound, worn = (moved("serial_6r", arcmin, "mpc", False) for arcmin in (0.0, 1.0))
    assert worn.unusable < WAITING
    assert worn.residual < 1.8 * sound.residual
    assert worn.off_path < 2e-3
    assert gain_db("serial_6r", 0.0) > gain_db("serial_6r", 1.0) > 4.0


def test_five_minutes_that_the_estimator_is_not_told_are_borne_with_a_sound_gauge_blamed() -> None:
    """The tip rests 1.5 mm and 2.2 mrad off under a tracker of 50 um and 0.1 mrad.

    Until gauges had a bias they could not be reconciled with the tracker: the state was lost, and the arm.
    """
    for law, blamed in (("pd", set()), ("mpc", {"forearm_strain_y"})):
        untold = moved("serial_6r", 5.0, law, False)
        assert untold.unusable < WAITING and untold.stopped == ""
        assert untold.off_path < 5e-3
        assert untold.blamed == blamed


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_of_five_minutes_that_are_told_mpc_gains_and_no_sound_sensor_is_blamed(seed: int) -> None:
    """Two encoders of the wrist, called swapped for 183 squared sigmas, once brought it near instability."""
    pd, mpc = (moved("serial_6r", 5.0, law, True, seed) for law in ("pd", "mpc"))
    assert all(run.unusable < WAITING and run.off_path < 5e-3 for run in (pd, mpc))
    assert mpc.blamed == frozenset()
    assert gain_db("serial_6r", 5.0, True, seed) > 5.0


def test_soft_springs_with_play_stay_stable_and_mpc_is_worth_less() -> None:
    gains = [gain_db("variable_stiffness", arcmin) for arcmin in (0.0, 1.0, 5.0)]
    assert gains[0] > 8.0 and 4.0 < gains[1] < gains[0] and -2.0 < gains[2] < gains[1]
    assert moved("variable_stiffness", 5.0, "mpc", False).unusable < WAITING
