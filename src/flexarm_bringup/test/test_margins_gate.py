"""The spill-over gate on the real descriptions, and whether the simulated rig does what it predicts."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh

from flexarm_bringup.cli import main
from flexarm_bringup.closed_loop import LoopSettings, run_loop
from flexarm_bringup.margins.command import with_settings
from flexarm_bringup.margins.loop import Loop
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.course import plan_course
from flexarm_bringup.tasks.task_for import task_for
from flexarm_controller.margins.case import Case
from flexarm_controller.reference import hold
from flexarm_controller.settings import ControllerConfig, MarginConfig, MpcConfig
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.strict_yaml import ConfigError
from flexarm_model.tree.reduced_tree import ReducedTree

TODAY = EstimatorConfig(acceleration_noise=0.03)
OPTIMISTIC = replace(TODAY, modal_force=1e-3)  # hardly any force on a mode that the axis does not excite
SURE = replace(OPTIMISTIC, frequency_error=0.03)  # and three instead of ten per cent of frequency
MODE_2 = 2  # free modes of the single link: axis, mode 1, mode 2
LOST = 0.01  # of a swing, when it no longer tells
KICK, SETTLED = 1e-4, 1.0  # kg^0.5 m/s: small beside every limit; s until the gains stand


@cache
def arm(preset: str = "light_hub") -> ManipulatorConfig:
    return load_config(find_manipulator("single_link"), preset)


@cache
def tree() -> ReducedTree:
    return ReducedTree(arm())


@cache
def cases(estimator: EstimatorConfig) -> tuple[Case, ...]:
    return tuple(Loop(arm(), estimator, (ControllerConfig(), MpcConfig())).cases())


def predicted(estimator: EstimatorConfig, error: float) -> float:
    """Return how fast the motion of mode 2 grows [1/s]."""
    case = next(case for case in cases(estimator) if case.frequency_error == error)
    radii = [abs(p) for p, name in zip(case.poles, case.pole_modes, strict=True) if name == "mode_2"]
    return float(np.log(max(radii)) * arm().rate_hz)


def simulated(estimator: EstimatorConfig, error: float, watched: float) -> float:
    """Hold still on a rig of hardly any noise, kick its mode 2 once, and return how fast it grows [1/s]."""
    settings = LoopSettings(estimator=estimator, rig=RigSettings(frequency_scale=1.0 + error, noise=1e-4))
    hardware = Hardware(arm(), settings.rig)
    plant = hardware.rig.plant
    M, _, K, _ = plant.tree.linearisation(plant.q)
    shape = eigh(K, M)[1][:, MODE_2]
    velocity = []

    def observe(rig: Hardware, estimate: object) -> dict[str, np.ndarray]:
        if rig.tick == round(SETTLED / rig.dt):
            plant.v = plant.v + KICK * shape
        velocity.append(float(shape @ M @ plant.v))
        return {}

    run_loop(hardware, tree(), hold(arm().home), SETTLED + watched, settings, observe)
    swings = np.abs(velocity[round((SETTLED + 0.15) / hardware.dt) :])  # without what dies out at once
    windows = swings[: swings.size // 10 * 10].reshape(-1, 10).max(axis=1)  # half a period of mode 2 and more
    windows = windows[: np.argmax(np.append(windows, 0.0) < LOST * windows[0])]  # above the rest of the noise
    t = np.arange(windows.size) * 10 * hardware.dt
    return float(np.polyfit(t, np.log(windows), 1)[0])


def test_todays_filter_keeps_its_margins_on_the_light_hub() -> None:
    loop = Loop(arm(), TODAY, (ControllerConfig(), MpcConfig()))
    assert loop.judge() == ""
    mode_2 = [case.margin("mode_2") for case in cases(TODAY)]
    assert min(margin.gain.decibels for margin in mode_2) > 3.0
    assert min(margin.delay for margin in mode_2) > 0.0025


def test_an_optimistic_filter_is_refused_and_mode_2_named() -> None:
    reason = Loop(arm(), OPTIMISTIC, (ControllerConfig(), MpcConfig())).judge()
    assert reason.startswith("margins: mode 2 is unstable, it grows by ")
    assert "frequencies -10 %" in reason
    settings = LoopSettings(estimator=OPTIMISTIC, margins=MarginConfig())
    with pytest.raises(ValueError, match="margins: mode 2 is unstable"):
        run_loop(Hardware(arm()), tree(), hold(arm().home), 0.1, settings, lambda rig, estimate: {})


@pytest.mark.slow
@pytest.mark.parametrize("error", [-0.1, -0.05, 0.0, 0.05, 0.1])
@pytest.mark.parametrize("estimator", [TODAY, SURE, OPTIMISTIC], ids=["today", "sure", "optimistic"])
def test_rig_and_gate_agree_over_frequency_error_and_optimism(
    estimator: EstimatorConfig, error: float
) -> None:
    growth, found = predicted(estimator, error), simulated(estimator, error, 0.8)
    assert found == pytest.approx(growth, rel=0.15, abs=0.3)  # far from zero the sign is the same, too


@pytest.mark.slow
@pytest.mark.parametrize("law", ["pd", "mpc"])
@pytest.mark.parametrize(
    ("name", "preset"),
    [
        ("planar_3rrr", "geared"),
        ("spatial_3tpt", "sim"),
        ("spatial_3tpt", "exp"),
        ("variable_stiffness", ""),
        ("variable_stiffness", "soft"),
        ("serial_6r", ""),
    ],
)
def test_the_other_arms_may_move_from_where_their_moves_begin_and_end(
    name: str, preset: str, law: str
) -> None:
    task, config = task_for(name).under(preset), load_config(find_manipulator(name), preset)
    course = plan_course(StaticArm(ReducedTree(config)), task, 1.0 / config.rate_hz)
    laws = replace(task.make("controller", ControllerConfig), law=law), task.make("mpc", MpcConfig)
    loop = Loop(config, task.make("estimator", EstimatorConfig), laws)
    for pose in (course.home, *(course.reference.position(leg.end) for leg in course.legs)):
        assert loop.judge(pose) == ""


@pytest.mark.slow
def test_the_gate_finds_the_pose_at_which_the_six_axis_arm_rings_by_itself() -> None:
    task, config = task_for("serial_6r"), load_config(find_manipulator("serial_6r"))
    laws = task.make("controller", ControllerConfig), replace(task.make("mpc", MpcConfig), time_limit=0.0)
    estimator = task.make("estimator", EstimatorConfig)
    settings = LoopSettings(controller=laws[0], mpc=laws[1], estimator=estimator)
    loop, speed = Loop(config, estimator, laws), {}
    for pose in ("home", "mid"):
        standing = replace(config, home=config.poses.get(pose, config.home))
        moving: list[float] = []

        def observe(rig: Hardware, estimate: object, moving: list[float] = moving) -> dict[str, np.ndarray]:
            moving.append(float(np.linalg.norm(rig.rig.plant.v)))
            return {}

        run_loop(Hardware(standing), ReducedTree(standing), hold(standing.home), 0.4, settings, observe)
        speed[pose] = float(np.mean(moving[-50:]))
    assert loop.judge(config.home) == ""
    assert "mode 8 is unstable" in loop.judge(config.poses["mid"])
    assert speed["mid"] > 5.0 * speed["home"]  # it rings at the limits of its torque


@pytest.mark.slow
def test_gauges_that_count_less_keep_the_six_axis_arm_at_its_named_poses_but_not_stretched_out() -> None:
    """It was told to keep every margin; the last pose is one of the grid of two values per axis."""
    task, config = task_for("serial_6r"), load_config(find_manipulator("serial_6r"))
    laws = task.make("controller", ControllerConfig), task.make("mpc", MpcConfig)
    loop = Loop(config, replace(task.make("estimator", EstimatorConfig), strain_error=2e-6), laws)
    assert [loop.judge(pose) for pose in (config.home, *config.poses.values())] == ["", "", ""]
    out = loop.judge(np.array([1.48, 1.18, -0.654, 1.57, 1.05, 3.05]))
    assert re.match(r"margins: gain margin of mode 1 \(28 Hz\) 5\.5 dB, 6 dB wanted, as described", out)


def test_the_command_tells_modes_and_poses(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = ["--json", str(tmp_path / "m.json")]
    assert main(["margins", "single_link", "--preset", "light_hub", "--along", "0", *files]) == 0
    assert "mode 2" in capsys.readouterr().out
    page = json.loads((tmp_path / "m.json").read_text(encoding="utf-8"))
    assert len(page["cases"]) == 5 and all(case["stable"] for case in page["cases"])
    assert [row[0] for row in page["tables"][0]["rows"]][:3] == ["all torques", "mode 1", "mode 2"]


@pytest.mark.slow
def test_the_page_has_poles_and_margins_as_figures_over_named_poses_and_moves(tmp_path: Path) -> None:
    html = tmp_path / "m.html"
    assert main(["margins", "planar_3rrr", "--along", "3", "--html", str(html)]) == 0
    assert html.read_text(encoding="utf-8").count("<svg") == 2


def test_the_command_fails_for_an_optimistic_filter(capsys: pytest.CaptureFixture[str]) -> None:
    noise = {
        "modal_force": "1e-3",
        "acceleration_noise": "0.03",
        "frequency_error": "0.1",
        "stiffness_modes": "0",
    }
    quick = "--set=mpc.input_jerk=216"  # with the slower torque of its moves file even this filter is borne
    options = [quick, *(f"--set=estimator.{name}={value}" for name, value in noise.items())]
    assert main(["margins", "single_link", "--preset", "light_hub", "--along", "0", *options]) == 1
    assert "mode 2 is unstable" in capsys.readouterr().out


@pytest.mark.parametrize("change", ["estimator.modal=1", "filter.gate=1", "estimator.modal_force=little"])
def test_a_setting_that_does_not_exist_is_refused(change: str) -> None:
    with pytest.raises(ValueError, match="--set"):
        with_settings(task_for("single_link"), [change])


def test_a_misspelt_setting_is_answered_with_those_there_are() -> None:
    with pytest.raises(ValueError, match=r"estimator has no 'modal'; it has .*modal_force"):
        with_settings(task_for("single_link"), ["estimator.modal=1"])


def test_lists_are_read_and_what_would_change_nothing_is_refused() -> None:
    """The period was overwritten by the description's, and no list could be given."""
    changed = with_settings(task_for("single_link"), ["mpc.horizon=20", "mpc.blocks=1,1,2,2,2,4,4,4"])
    assert changed.make("mpc", MpcConfig).blocks == (1, 1, 2, 2, 2, 4, 4, 4)
    for change, words in (
        ("mpc.blocks=1,x", "numbers with commas"),
        ("mpc.blocks=1.5,39", "whole numbers"),
        ("controller.period=0.02", "served.rate"),
    ):
        with pytest.raises(ValueError, match=words):
            with_settings(task_for("single_link"), [change])


def test_a_switch_among_the_settings_is_true_or_false() -> None:
    changed = with_settings(task_for("single_link"), ["mpc.firm_time=0", "mpc.velocity_limit=false"])
    mpc = changed.make("mpc", MpcConfig)
    assert mpc.position_limit is True and mpc.velocity_limit is False
    with pytest.raises(ConfigError, match="'1' is not one of true, false"):
        with_settings(task_for("single_link"), ["mpc.foresight=1"])


def test_settings_that_are_words_can_be_changed_too() -> None:
    changed = with_settings(task_for("single_link"), ["controller.law=pd"])
    assert changed.make("controller", ControllerConfig).law == "pd"
    with pytest.raises(ValueError, match="law: 'firm' is not one of mpc"):
        with_settings(task_for("single_link"), ["controller.law=firm"])
