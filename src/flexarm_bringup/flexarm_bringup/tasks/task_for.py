"""What an arm does in "flexarm sim": its moves file, or without one a tour of its named poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.tasks.centripetal import centripetal_error
from flexarm_bringup.tasks.learned_stiffness import learn_stiffness
from flexarm_bringup.tasks.task import FOLDER, Task, find_task, load_task
from flexarm_bringup.tasks.task_check import ROUNDING, SAMPLES, check_against_arm
from flexarm_bringup.tasks.task_moves import LONGEST, ByAxes, TaskMove, ToPose
from flexarm_bringup.tasks.weights_by_arm import weights_for
from flexarm_bringup.tip_vibration import NYQUIST_SHARE, Watch
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.motion.profiles import Profile, Trapezoid
from flexarm_model.reading.config import FORMAT, load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.reading.share import share_folders
from flexarm_model.served.linearize import PoseError, linearize
from flexarm_model.settings.strict_yaml import ConfigError, read_yaml
from flexarm_model.tree.closure_error import ClosureError
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
DURATION, RAMP = 1.0, 0.05  # s of every move, and of its ramps: short ones shake the arm
WAIT = 2.5  # s
STRIDE = {"t": 0.04, "r": np.radians(20.0)}  # of the first axis, where no pose is named [m or rad]
EASY = 0.8  # of a velocity or a way that is shorter than the tour would have it
WATCH = Watch(0.1, 2.1, 50.0, 5e-4)
# of an arm nobody has tuned: it may be softer, heavier and under gravity
SETTINGS: dict[str, dict[str, Any]] = {
    "schedule": {"angle": 0.1, "length": 0.005},  # rad, m; the shipped arms: 0.05 to 0.13, 0.005
    "estimator": {
        "filter": "corrected",  # goals are as fast as the motors: a linear model lost two_link at 4 rad/s
        "disturbance_drift": 0.3,  # rad/s^2/sqrt(s); what changes with pose and speed between two models
        "gate": 10.0,  # sigmas; with 5 sound gauges are refused on ramps of 50 ms
        "sag_modes": 4,  # where it rests is learned: else an upright arm 20 % softer is lost
        "sag_error": 1e-3,  # m
        "sag_time": 1.0,  # s, as long as a move
    },
    "mpc": {"arm_torque": True},  # which that filter takes out of the unmodelled one
}
HANGING = {"sag_share": 0.3, "sag_error": 5e-4}  # most of where it rests is a share of how it sags by itself


def task_for(name: str) -> Task:
    """Return the task of an arm or of a moves file.

    Args:
        name: Name of a manipulator, path of a description, or path of a moves file.

    Raises:
        ConfigError: There is none, or anything is wrong with it.
    """
    is_path = name.endswith((".yaml", ".yml"))
    if is_path and read_yaml(find_manipulator(name)).get("format") != FORMAT:
        return _checked(find_task(name))
    known = [share / FOLDER / f"{name}.yaml" for share in share_folders("flexarm_bringup")]
    if not is_path and any(path.is_file() for path in known):
        return _checked(find_task(name))
    config = load_config(find_manipulator(name))
    return learn_stiffness(tour(name, config), config)


def _checked(path: Path) -> Task:
    """Return the task of a moves file that its arm can do."""
    task = load_task(path)
    check_against_arm(task)
    return task


def tour(name: str, config: ManipulatorConfig, profile: Profile | None = None) -> Task:
    """Return the task of going to every named pose and home again, or of moving the first axis.

    Where an axis would be too fast, the move takes longer; where there is no room, the first axis turns the
    other way or less.

    Args:
        name: Of the manipulator.
        config: Its description.
        profile: Of every move, from 0 to 1; None takes 1 s with short ramps.

    Raises:
        ConfigError: The arm has no motor.
    """
    if not config.actuated:
        raise ConfigError(f"manipulator: '{name}': no axis is actuated; expected at least one to move")
    profile = profile or Trapezoid(1.0, DURATION, RAMP, RAMP)
    home, goals = np.array(config.home), list(config.poses.values())
    stride = {} if goals else dict([_stride(config)])
    if stride:
        goals = [home + np.eye(home.size)[0] * next(iter(stride.values()))]
    ways = np.diff([home, *goals, home], axis=0)
    profiles = [_slow_enough(profile, way, config) for way in ways]
    _refuse_long(name, config, profiles, ways)
    moves: dict[str, TaskMove] = {
        f"to {pose}": ToPose(pose, own) for pose, own in zip(config.poses, profiles, strict=False)
    }
    if stride:
        moves["out"] = ByAxes(stride, profiles[0])
    moves["home"] = ToPose("home", profiles[-1])
    longest = max(move.profile.duration for move in moves.values())
    pace = f"{profile.duration:g} s a move"
    if longest > profile.duration:
        pace = f"up to {longest:.3g} s a move, so that no axis is too fast"
    return Task(
        manipulator=name,
        presets=("",),
        start="home",
        lead=0.5,
        wait=WAIT,
        moves=moves,
        watch=replace(WATCH, cutoff_hz=min(WATCH.cutoff_hz, NYQUIST_SHARE * config.rate_hz / 2)),
        gain_db=0.0,
        speed=1.0,
        assumed=(
            f"no moves file: a tour of the named poses (or one stride of the first axis), {pace}",
            "no settings tuned for this arm: a new model every 0.1 rad or 5 mm; weights of MPC by its "
            "slowest mode; where it rests is learned; filter: corrected",
        ),
        settings=_settings(config, profiles, ways),
    )


def _settings(
    config: ManipulatorConfig, profiles: Sequence[Profile], ways: Array
) -> dict[str, dict[str, Any]]:
    """Return what is expected of an arm nobody has tuned that goes ways (k, n_theta) on profiles."""
    pairs = zip(profiles, ways, strict=True)
    fastest = np.max([_peak_rate(profile) * abs(way) for profile, way in pairs], axis=0)
    error = centripetal_error(config, dict(zip(config.actuated, fastest.tolist(), strict=True)))
    return {
        **SETTINGS,
        "estimator": {
            **SETTINGS["estimator"],
            **(HANGING if config.gravity.any() else {}),
            "acceleration_error": error,
        },
        "mpc": {**SETTINGS["mpc"], **_weights(config)},
    }


def _weights(config: ManipulatorConfig) -> dict[str, Any]:
    """Return the weights of the predictive law; none without a model at home: others will say so."""
    try:
        model = linearize(ReducedTree(config, use_compiler=False))
    except (PoseError, ClosureError):
        return {}
    return weights_for(model, 1.0 / config.rate_hz)


def _peak_rate(profile: Profile) -> float:
    """Return how fast a profile gets [1/s]."""
    return float(abs(profile.sample(np.linspace(0.0, profile.duration, SAMPLES))[1]).max())


def _slow_enough(profile: Profile, way: Array, config: ManipulatorConfig) -> Profile:
    """Return a profile, stretched if need be, on which no axis on its way (n_theta,) exceeds its velocity."""
    limits = np.array([axis.velocity for axis in config.actuated.values()])
    share = float((_peak_rate(profile) * abs(way) / limits).max())
    return profile if share <= 1.0 + ROUNDING else profile.stretched(profile.duration * share / EASY)


def _refuse_long(name: str, config: ManipulatorConfig, profiles: Sequence[Profile], ways: Array) -> None:
    """Refuse a tour one of whose ways (k, n_theta) takes an axis too long.

    Raises:
        ConfigError: Names the axis.
    """
    axes, velocities = list(config.actuated), [axis.velocity for axis in config.actuated.values()]
    for profile, way in zip(profiles, ways, strict=True):
        if profile.duration > LONGEST:
            slowest = int((abs(way) / velocities).argmax())
            raise ConfigError(
                f"manipulator: '{name}': at the velocity of {axes[slowest]}, {velocities[slowest]:g} SI, "
                f"a move of its tour would take {profile.duration:g} s; at most {LONGEST:g} s are allowed"
            )


def _stride(config: ManipulatorConfig) -> tuple[str, float]:
    """Return the first axis and how far it goes from home [rad or m]: forth, else back, else less."""
    name, axis = next(iter(config.actuated.items()))
    stride = float(STRIDE[name.rpartition(".")[2][0]])
    ahead, behind = axis.upper - config.home[0], config.home[0] - axis.lower
    if stride <= ahead:
        return name, stride
    if stride <= behind:
        return name, -stride
    return name, float(EASY * (ahead if ahead >= behind else -behind))
