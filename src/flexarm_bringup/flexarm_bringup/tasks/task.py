"""Representative moves of a manipulator as data: what it does, when it is judged, how it is tuned.

A task file (config/moves/NAME.yaml) stands beside the manipulator's and holds what belongs to a use of the
arm and not to the arm: a list of moves, one after the other, the window in which what is left of the
vibration is read, how often a new model is served, and the settings in which this machine's estimator and
controller differ from the defaults.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, TypeVar

from flexarm_bringup.compare_laws.comparison import Comparison, read_comparison
from flexarm_bringup.share import share_path
from flexarm_bringup.tasks.task_moves import LONGEST, TaskMove, read_axes, read_move
from flexarm_bringup.tip_vibration import Watch
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_estimator.drift.settings import DriftConfig
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.served.model_schedule import ScheduleSettings
from flexarm_model.settings.overrides import apply_overrides
from flexarm_model.settings.parameters import ParameterError
from flexarm_model.settings.strict_yaml import ConfigError, Section, read_yaml

FORMAT = "flexarm-moves/1"
FOLDER = "config/moves"
UNTUNED = (  # told as assumed where a moves file has none
    "settings of estimator and law: the defaults, tuned for no arm, as the moves file has none; given the "
    "description itself the commands choose some"
)
Settings = TypeVar("Settings")


@dataclass(frozen=True)
class Task:
    """What a manipulator is to do.

    Attributes:
        manipulator: Name or path of its description.
        presets: Presets of it to run, the first one with everything that may be wrong with the model.
        start: Pose it starts from: its name, or the actuated axes by name [rad or m], the others at zero.
        lead: Time before the first move, in which the estimator settles [s].
        wait: Time after every move [s].
        moves: By name, in order.
        watch: How they are judged.
        gain_db: What MPC shall gain on joint PD, at least [dB].
        speed: Simulated seconds per second of one core that are wanted, at least [1].
        assumed: What is not published about the moves.
        settings: What differs from the defaults of estimator, controller and schedule, by section.
        compare: How "flexarm compare" compares laws on it.
        preset_settings: What differs from ``settings`` under a preset, by preset and section.
        file: Where it was read; empty for a task that no file holds.
    """

    manipulator: str
    presets: tuple[str, ...]
    start: str | Mapping[str, float]
    lead: float
    wait: float
    moves: Mapping[str, TaskMove]
    watch: Watch
    gain_db: float
    speed: float
    assumed: tuple[str, ...] = ()
    settings: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    compare: Comparison = field(default_factory=Comparison)
    preset_settings: Mapping[str, Mapping[str, Mapping[str, Any]]] = field(default_factory=dict)
    file: str = ""

    def make(self, section: str, config_class: type[Settings]) -> Settings:
        """Return settings: defaults with the task's values."""
        return apply_overrides(config_class, self.settings.get(section, {}))

    def under(self, preset: str) -> Task:
        """Return the task with the settings that it has under a preset of the description."""
        own = self.preset_settings.get(preset, {})
        merged = {name: {**self.settings.get(name, {}), **own.get(name, {})} for name in SECTIONS}
        return replace(self, settings=merged, preset_settings={})


def other_law(task: Task, presets: Iterable[str]) -> tuple[str, ...]:
    """Return what to tell where a study of MPC is of an arm whose moves ask for another law, if they do."""
    laws = {task.under(preset).make("controller", ControllerConfig).law for preset in presets}
    return tuple(
        f"the moves ask for law '{law}'; what is called MPC here is law 'mpc', with its settings"
        for law in sorted(laws - {ControllerConfig().law})
    )


SECTIONS: dict[str, type] = {
    "controller": ControllerConfig,
    "mpc": MpcConfig,
    "motion": MotionConfig,
    "estimator": EstimatorConfig,
    "schedule": ScheduleSettings,
    "drift": DriftConfig,
}


def find_task(manipulator: str) -> Path:
    """Return the task file of a manipulator: its own name in config/moves, or a path.

    Raises:
        ConfigError: There is none.
    """
    if manipulator.endswith((".yaml", ".yml")):
        return Path(manipulator)
    try:
        return share_path(f"{FOLDER}/{manipulator}.yaml")
    except FileNotFoundError as error:
        raise ConfigError(f"moves: '{manipulator}': {error}") from None


def load_task(path: Path) -> Task:
    """Read a task file.

    Raises:
        ConfigError: Anything is wrong with it; names file, key, value and what is allowed.
    """
    top = Section(read_yaml(path), str(path))
    top.choice("format", (FORMAT,))
    wait = top.quantity("wait", "time", above=0.0, below=LONGEST)
    settings = _read_settings(top.section("settings", {}))
    task = Task(
        manipulator=top.text("manipulator", path.stem),
        presets=_read_presets(top),
        start=_read_start(top),
        lead=top.quantity("lead", "time", 0.5, above=0.0, below=LONGEST),
        wait=wait,
        moves=_read_moves(top),
        watch=_read_watch(top.section("watch"), wait),
        gain_db=top.quantity("gain_db", "ratio", 12.0),
        speed=top.quantity("speed", "ratio", 5.0, above=0.0),
        assumed=(*top.texts("assumed", ()), *(() if any(settings.values()) else (UNTUNED,))),
        settings=settings,
        compare=read_comparison(top.section("compare", {})),
        preset_settings={
            preset: _read_settings(section) for preset, section in top.sections("preset_settings", {})
        },
        file=str(path),
    )
    top.done()
    _check_settings(task, "settings")
    for preset in task.preset_settings:
        _check_settings(task.under(preset), f"preset_settings.{preset}")
    return task


def _read_presets(top: Section) -> tuple[str, ...]:
    presets = top.texts("presets", ("",))
    if not presets or len(set(presets)) < len(presets):
        allowed = "expected at least one, each once; leave the key out for none"
        raise top.error("presets", list(presets), allowed)
    return presets


def _read_moves(top: Section) -> dict[str, TaskMove]:
    moves = {name: read_move(section) for name, section in top.sections("moves")}
    if not moves:
        raise top.error("moves", moves, "expected at least one move")
    for name, move in moves.items():
        if move.profile.duration > LONGEST:
            raise top.error(
                f"moves.{name}", f"{move.profile.duration:g} s", f"may take {LONGEST:g} s at most"
            )
    return moves


def _read_watch(section: Section, wait: float) -> Watch:
    """Return how moves are judged: in a window of the time [s] that the arm waits after each."""
    watch = Watch(
        section.quantity("from", "time", at_least=0.0),
        section.quantity("to", "time"),
        section.quantity("below", "frequency", above=0.0),
        section.quantity("tolerance", "length", above=0.0),
    )
    if not watch.begin < watch.end <= wait:
        allowed = f"must be after 'from', {watch.begin:g} s, and within the wait, {wait:g} s"
        raise section.error("to", section.take("to"), allowed)
    section.done()
    return watch


def _check_settings(task: Task, key: str) -> None:
    """Raise ConfigError where a setting is outside its range."""
    for name, config_class in SECTIONS.items():
        try:
            task.make(name, config_class)
        except ParameterError as error:
            field_name, _, allowed = str(error).partition(": ")
            given = task.settings.get(name, {})
            section = Section(dict(given), task.file, f"{key}.{name}")
            raise section.error(field_name, given.get(field_name, "the default"), allowed) from None
    is_told_twice = task.make("estimator", EstimatorConfig).filter == "linear"
    if is_told_twice and task.make("mpc", MpcConfig).arm_torque:
        section = Section(dict(task.settings["mpc"]), task.file, f"{key}.mpc")
        allowed = "expected false with estimator.filter linear, which tells this torque as an unmodelled one"
        raise section.error("arm_torque", True, allowed)


def _read_start(top: Section) -> str | dict[str, float]:
    if isinstance(top.take("start", "home"), dict):
        return read_axes(top.section("start"))
    return top.text("start", "home")


def _read_settings(section: Section) -> dict[str, dict[str, Any]]:
    """Return the values by section; they are plain numbers in SI, as ROS parameters are."""
    settings: dict[str, dict[str, Any]] = {}
    for name, config_class in SECTIONS.items():
        inner = section.section(name, {})
        settings[name] = {
            item.name: inner.take(item.name)
            for item in fields(config_class)  # type: ignore[arg-type]
            if inner.has(item.name)
        }
        inner.done()
    section.done()
    return settings
