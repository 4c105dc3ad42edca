"""Whether an arm can do what its moves file asks: presets, poses, axes, their ranges and velocities.

What takes the arm's kinematics (the tip's lines and squares) is found out when the course is planned.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.tasks.task import Task
from flexarm_bringup.tasks.task_moves import ByAxes, TaskMove, ToPose
from flexarm_bringup.tip_vibration import NYQUIST_SHARE
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.motion.profiles import Profile
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.strict_yaml import ConfigError
from flexarm_model.settings.units import axis_dimension, si_unit

Array = NDArray[np.float64]
ACCELEROMETER = "accelerometer"  # a kind of sensor, and a signal of compare
SAMPLES = 1001  # of a profile, to find how fast it gets
ROUNDING = 1e-9  # of a limit
FEWEST = 2  # control periods that a move takes, and the window in which it is watched


def check_against_arm(task: Task) -> None:
    """Refuse a task that its arm cannot do under one of its presets.

    Args:
        task: What the moves file says.

    Raises:
        ConfigError: Names file, key, value and what is allowed.
    """
    path, arm = task.file, _Presets(task)
    for preset in task.presets:
        config = arm.under("presets", preset)
        start = _start(path, task, config)
        _check_watch(path, task, config)
        _check_moves(path, "moves", task.moves, start, config)
        _check_moves(path, "compare.moves", task.compare.moves, start, config)
    for key, presets in (
        ("preset_settings", task.preset_settings),
        ("compare.other_presets_db", task.compare.other_presets_db),
    ):
        for preset in presets:
            arm.under(key, preset)


def refusal(path: str, key: str, value: object, allowed: str) -> ConfigError:
    """Return the error for a key of a moves file."""
    return ConfigError(f"{path}: {key}: {value!r}: {allowed}")


class _Presets:
    """Descriptions of a task's arm under its presets, each read once."""

    def __init__(self, task: Task) -> None:
        """Read the arm without a preset; ConfigError where there is none."""
        self._path = task.file
        try:
            self._file = find_manipulator(task.manipulator)
        except ConfigError as error:
            named = "without this key the file is of the arm it is named after"
            raise ConfigError(f"{task.file}: {error}; {named}") from None
        try:
            self._known = {"": load_config(self._file)}
        except ConfigError as error:
            raise refusal(task.file, "manipulator", task.manipulator, str(error)) from None

    def under(self, key: str, preset: str) -> ManipulatorConfig:
        """Return the description under a preset that a key of the moves file names."""
        if preset not in self._known:
            try:
                self._known[preset] = load_config(self._file, preset)
            except ConfigError as error:
                raise refusal(self._path, key, preset, str(error)) from None
        return self._known[preset]


def _check_watch(path: str, task: Task, config: ManipulatorConfig) -> None:
    highest, shortest = NYQUIST_SHARE * config.rate_hz / 2, FEWEST / config.rate_hz
    if task.watch.cutoff_hz > highest:
        allowed = f"the tip is looked at {config.rate_hz:g} times a second; expected at most {highest:g} Hz"
        raise refusal(path, "watch.below", task.watch.cutoff_hz, allowed)
    if task.compare.signal == ACCELEROMETER and not any(s.kind == ACCELEROMETER for s in config.sensors):
        allowed = "the arm has no sensor of this kind; expected tip"
        raise refusal(path, "compare.signal", task.compare.signal, allowed)
    if task.watch.end - task.watch.begin < shortest:
        allowed = f"expected at least {FEWEST} control periods, {shortest:g} s, after 'from'"
        raise refusal(path, "watch.to", task.watch.end, allowed)


def _start(path: str, task: Task, config: ManipulatorConfig) -> Array:
    if isinstance(task.start, str):
        return _pose(path, "start", task.start, config)
    start = _vector(path, "start", task.start, config)
    _check_range(path, "start", dict(task.start), start, config)
    return start


def _check_moves(
    path: str, key: str, moves: Mapping[str, TaskMove], at: Array | None, config: ManipulatorConfig
) -> None:
    """Check moves one after the other; ``at`` (n_theta,) is None where only the tip is known."""
    for name, move in moves.items():
        inside = f"{key}.{name}"
        if move.profile.duration < FEWEST / config.rate_hz:
            allowed = f"expected at least {FEWEST} control periods, {FEWEST / config.rate_hz:g} s"
            raise refusal(path, f"{inside}.duration", move.profile.duration, allowed)
        goal = None
        if isinstance(move, ToPose):
            goal = _pose(path, f"{inside}.to", move.pose, config)
            _check_way(
                path, f"{inside}.to", move.pose, None if at is None else goal - at, move.profile, config
            )
        elif isinstance(move, ByAxes):
            way = _vector(path, f"{inside}.by", move.distance, config)
            _check_way(path, f"{inside}.by", move.distance, way, move.profile, config)
            goal = None if at is None else at + way
            if goal is not None:
                _check_range(path, f"{inside}.by", move.distance, goal, config)
        at = goal


def _pose(path: str, key: str, name: str, config: ManipulatorConfig) -> Array:
    poses = {"home": config.home, **config.poses}
    if name not in poses:
        raise refusal(path, key, name, f"no such pose; the description has {', '.join(poses)}")
    return np.array(poses[name])


def _vector(path: str, key: str, by_axis: Mapping[str, float], config: ManipulatorConfig) -> Array:
    for axis in by_axis:
        if axis not in config.actuated:
            allowed = f"no such axis; actuated are {', '.join(config.actuated)}"
            raise refusal(path, f"{key}.{axis}", by_axis[axis], allowed)
    return np.array([by_axis.get(axis, 0.0) for axis in config.actuated])


def _check_range(path: str, key: str, value: object, goal: Array, config: ManipulatorConfig) -> None:
    for (name, axis), there in zip(config.actuated.items(), goal, strict=True):
        slack = ROUNDING * max(abs(there), 1.0)
        if not axis.lower - slack <= there <= axis.upper + slack:
            unit = si_unit(axis_dimension(axis.name, "position"))
            allowed = (
                f"{name} would be at {there:.6g}; it must lie within [{axis.lower:.6g}, {axis.upper:.6g}]"
            )
            raise refusal(path, key, value, f"{allowed} {unit}")


def _check_way(
    path: str, key: str, value: object, way: Array | None, profile: Profile, config: ManipulatorConfig
) -> None:
    """Refuse a way (n_theta,) [rad or m] that goes nowhere or is too fast for an axis."""
    if way is None:
        return
    if not way.any():
        raise refusal(path, key, value, "moves no axis; expected a move that goes somewhere")
    fastest = abs(profile.sample(np.linspace(0.0, profile.duration, SAMPLES))[1]).max()
    for (name, axis), part in zip(config.actuated.items(), way, strict=True):
        if fastest * abs(part) > axis.velocity * (1.0 + ROUNDING):
            unit = si_unit(axis_dimension(axis.name, "velocity"))
            least = profile.duration * fastest * abs(part) / axis.velocity
            allowed = f"{name} would run at {fastest * abs(part):.6g}, at most {axis.velocity:.6g} {unit}; "
            raise refusal(path, key, value, f"{allowed}expected a duration of at least {least:.3g} s")
