"""The sixth arm, docs/two_link.yaml: one file and no code, from description to closed loop."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from flexarm_bringup.closed_loop import LoopSettings, observe_tick, run_loop
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim_run.conditions import NOMINAL
from flexarm_bringup.sim_run.study import loop_settings, sim_jobs
from flexarm_bringup.tasks.task_for import task_for
from flexarm_controller.joint_loop import JointLoop
from flexarm_controller.joint_pd import JointPd
from flexarm_controller.reference import Reference
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_estimator.estimate import Estimate
from flexarm_model.motion.profiles import Trapezoid
from flexarm_model.reading.config import load_config
from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

DOCS = Path(__file__).resolve().parents[1] / "docs"
ARM = DOCS / "two_link.yaml"


def test_the_walk_through_prints_the_frequencies_of_its_arm() -> None:
    model = linearize(ReducedTree(load_config(ARM), use_compiler=False))
    text = (DOCS / "your_own_arm.md").read_text(encoding="utf-8")
    for hertz in model.omega[:2] / (2 * np.pi):
        assert f"{hertz:.5g}" in text


def test_its_segments_have_the_same_slow_modes() -> None:
    config = load_config(ARM)
    model, segments = linearize(ReducedTree(config, use_compiler=False)), SegmentTree(config, 16)
    found = segments.locked_frequencies(segments.settle(config.home), 2)
    assert found == pytest.approx(model.omega[:2], rel=2e-3)


def test_without_a_moves_file_it_tours_its_named_poses() -> None:
    assert list(task_for(str(ARM)).moves) == ["to stretched", "home"]


def test_the_moves_file_of_the_walk_through_can_be_used(tmp_path: Path) -> None:
    text = (DOCS / "your_own_arm.md").read_text(encoding="utf-8")
    assert "\nmanipulator: docs/two_link.yaml " in text  # commands are typed in the folder of the repository
    moves = text[text.index("format: flexarm-moves/1") :].partition("```")[0]
    (tmp_path / "moves.yaml").write_text(moves.replace("docs/two_link.yaml", str(ARM)), encoding="utf-8")
    task = task_for(str(tmp_path / "moves.yaml"))
    assert len(sim_jobs(task, task.presets, [NOMINAL])) == 1
    assert task.settings["estimator"] == task_for(str(ARM)).settings["estimator"]
    assert task.settings["schedule"] == {"angle": 0.1}


@pytest.mark.parametrize(("thicker", "softer"), [(1.0, 1.0), (1.6, 1.0), (1.6, 0.5)])
def test_joint_pd_holds_it_in_a_vertical_plane(tmp_path: Path, thicker: float, softer: float) -> None:
    """Of stiffer links they were lowered to nothing: with all the damping none bear modes and gravity."""
    text = ARM.read_text(encoding="utf-8").replace("[0 m/s^2, 0 m/s^2,", "[0 m/s^2, -9.81 m/s^2,")
    for depth in (5, 4):
        text = text.replace(f"along_y: {depth} mm", f"along_y: {thicker * depth} mm")
    (tmp_path / "arm.yaml").write_text(text, encoding="utf-8")
    model, settings = linearize(ReducedTree(load_config(tmp_path / "arm.yaml"))), ControllerConfig(law="pd")
    settings = replace(settings, pd_damping=softer * settings.pd_damping)
    pd = JointPd(model, settings, MpcConfig())
    assert JointLoop(model, settings.period, 1).bears(pd.K_p, pd.K_d)
    assert pd.frequency.min() > 0.1 * pd.wanted.min()
    assert pd.damping_ratio <= settings.pd_damping


@pytest.mark.slow
def test_on_its_tour_in_a_vertical_plane_no_sound_sensor_is_accused(tmp_path: Path) -> None:
    path = tmp_path / "arm.yaml"
    text = ARM.read_text(encoding="utf-8")
    path.write_text(text.replace("[0 m/s^2, 0 m/s^2,", "[0 m/s^2, -9.81 m/s^2,"), encoding="utf-8")
    (job,) = sim_jobs(task_for(str(path)), ("",), [NOMINAL])
    config = load_config(path)
    settings = loop_settings(job.task, "mpc", RigSettings())

    def observe(hardware: Hardware, estimate: Estimate) -> dict[str, NDArray[np.float64]]:
        """Return the error of the tip [m], whether the state is lost, how many sensors are accused."""
        accused = sum(sensor.status == "faulty" for sensor in estimate.sensors)
        off = estimate.T_world_tip[:3, 3] - hardware.rig.plant.tip_pose()[:3, 3]
        return {
            "off": np.linalg.norm(off),
            "lost": np.array(estimate.status == "lost"),
            "accused": np.array(accused),
        }

    course = job.course
    rows, _ = run_loop(
        Hardware(config, settings.rig), ReducedTree(config), course.reference, course.end, settings, observe
    )
    assert not any(row["lost"] or row["accused"] for row in rows)
    assert max(row["off"] for row in rows) < 1e-3  # with one model for all poses: lost, 60 mm


@pytest.mark.slow
def test_under_control_it_rings_less_than_under_joint_pd() -> None:
    config = load_config(ARM)
    tree = ReducedTree(config)
    profile = Trapezoid(1.0, 0.8, 0.05, 0.05)
    t = np.arange(0.0, 0.8, 1.0 / config.rate_hz)
    share, rate, acceleration = profile.sample(t)
    way = np.radians([20.0, 0.0])
    reference = Reference(
        t, config.home + share[:, None] * way, rate[:, None] * way, acceleration[:, None] * way
    )
    left = {}
    for law in ("pd", "mpc"):
        settings = LoopSettings(controller=ControllerConfig(law=law), rig=RigSettings(extra_modes=0))
        rows, effort = run_loop(Hardware(config, settings.rig), tree, reference, 1.4, settings, observe_tick)
        assert not effort.guard
        strain = np.array([row["strain"] for row in rows if row["t"] > 0.86])
        left[law] = float(np.sqrt(np.mean((strain - strain.mean(axis=0)) ** 2)))
    assert left["mpc"] < 0.4 * left["pd"]


def test_a_wrong_key_in_it_is_named(tmp_path: Path) -> None:
    text = ARM.read_text(encoding="utf-8").replace("damping_ratio: 1 %", "dampening: 1 %", 1)
    (tmp_path / "arm.yaml").write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=r"bodies\.upper\.(damping_ratio|dampening)"):
        load_config(tmp_path / "arm.yaml")
