"""Whatever is wrong in a moves file is refused with file, key, value and what is allowed."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from test_task import ARM

from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.course import plan_course
from flexarm_bringup.tasks.task import UNTUNED, Task
from flexarm_bringup.tasks.task_for import task_for
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.strict_yaml import ConfigError
from flexarm_model.tree.reduced_tree import ReducedTree

LIMITS = "upper: 180 deg, velocity: 4 rad/s}"
PRESETS = "presets: {heavy: {bodies.hand.mass: 200 g}, light: {bodies.hand.mass: 50 g}}\n"
TASK: dict[str, Any] = yaml.safe_load("""
format: flexarm-moves/1
presets: ["", heavy]
start: home
lead: 0.5 s
wait: 0.5 s
watch: {from: 50 ms, to: 0.4 s, below: 30 Hz, tolerance: 0.1 mm}
gain_db: 6
speed: 2
moves:
  bend: {by: {elbow.ry: 20 deg, lift.ty: 10 mm}, duration: 0.5 s}
  B: {to: B, duration: 1 s, ramps: [0.3 s, 0.2 s]}
  along: {shift: [0 mm, 30 mm, -40 mm], duration: 0.4 s, keep_orientation: false}
settings:
  mpc: {horizon: 20, blocks: [2, 2, 4, 6, 6]}
  schedule: {angle: 0.1}
preset_settings:
  light: {estimator: {gate: 10.0}}
assumed: [all of it]
compare:
  moves:
    out: {by: {shoulder.ry: 10 deg}, duration: 1 s}
  signal: tip
  worst_db: -30
  other_presets_db: {heavy: -20}
""")
SQUARE = {"square": {"side": "100 mm", "radius": "20 mm", "speed": "0.1 m/s", "acceleration": "1 m/s^2"}}

# (what it is, key, value, what the message must say)
WRONG: list[tuple[str, str, Any, tuple[str, ...]]] = [
    ("no moves", "moves", {}, ("moves: {}", "at least one move")),
    ("no such pose", "moves.B.to", "C", ("moves.B.to: 'C'", "home, B")),
    ("no such pose to compare on", "compare.moves.out", {"to": "C", "duration": "1 s"},
     ("compare.moves.out.to",)),
    ("no such start", "start", "C", ("start: 'C'", "home, B")),
    ("start of no axis", "start", {}, ("start: {}", "at least one axis")),
    ("start of an unknown axis", "start", {"wrist.ry": "0 deg"}, ("start.wrist.ry", "elbow.ry, lift.ty")),
    ("start out of range", "start", {"lift.ty": "2 m"}, ("start: ", "lift.ty would be at 2", "[-1, 1] m")),
    ("no axis", "moves.bend.by", {}, ("moves.bend.by: {}", "at least one axis")),
    ("unknown axis", "moves.bend.by", {"wrist.ry": "1 deg"}, ("by.wrist.ry", "elbow.ry, lift.ty")),
    ("unknown kind of axis", "moves.bend.by", {"elbow.yaw": "1 deg"},
     ("by.elbow.yaw", "tx, ty, tz, rx, ry, rz")),
    ("axis without a joint", "moves.bend.by", {"ry": "1 deg"},
     ("moves.bend.by.ry", "name of a joint, a dot")),
    ("axis without unit", "moves.bend.by", {"elbow.ry": 20}, ("by.elbow.ry: 20", "no unit", "deg")),
    ("nowhere", "moves.bend.by", {"elbow.ry": "0 deg"}, ("moves.bend.by", "moves no axis")),
    ("where it is", "moves.bend", {"to": "home", "duration": "1 s"}, ("bend.to: 'home'", "moves no axis")),
    ("out of range", "moves.bend.by", {"lift.ty": "1.1 m"},
     ("bend.by", "lift.ty would be at 1.1", "[-1, 1] m")),
    ("too fast", "moves.bend.duration", "100 ms", ("bend.by", "at most 4 rad/s", "at least 0.164 s")),
    ("no shift", "moves.along.shift", ["0 m", "0 m", "0 m"], ("moves.along.shift", "moves nothing")),
    ("flat shift", "moves.along.shift", ["1 mm", "0 m"], ("moves.along.shift", "a list of 3")),
    ("no duration", "moves.bend.duration", "0 s", ("moves.bend.duration: '0 s'", "above 0")),
    ("too short", "moves.along.duration", "5 ms",
     ("moves.along.duration", "at least 2 control periods, 0.01 s")),
    ("duration without unit", "moves.bend.duration", 1, ("moves.bend.duration: 1", "no unit")),
    ("ramps too long", "moves.B.ramps", ["0.6 s", "0.6 s"], ("moves.B.ramps", "1.2 s", "duration, 1 s")),
    ("ramp of nothing", "moves.B.ramps", ["0 s", "0.2 s"], ("moves.B.ramps", "must be > 0 s")),
    ("one ramp", "moves.B.ramps", ["0.2 s"], ("moves.B.ramps", "a list of 2")),
    ("corners too round", "moves.bend", {**SQUARE, "square": {**SQUARE["square"], "radius": "60 mm"}},
     ("moves.bend.square", "corner radius 0.06 m", "at most 0.05 m")),
    ("too fast for its way", "moves.bend", {**SQUARE, "square": {**SQUARE["square"], "speed": "9 m/s"}},
     ("moves.bend.square", "must be <= t_m")),
    ("watched backwards", "watch.to", "40 ms", ("watch.to: '40 ms'", "after 'from', 0.05 s")),
    ("watched beyond the wait", "watch.to", "0.6 s", ("watch.to: '0.6 s'", "within the wait, 0.5 s")),
    ("watched before the end", "watch.from", "-10 ms", ("watch.from: '-10 ms'", "at least 0")),
    ("watched for an instant", "watch.from", "399 ms", ("watch.to", "at least 2 control periods, 0.01 s")),
    ("watched too fast", "watch.below", "100 Hz", ("watch.below", "200 times a second", "at most 90 Hz")),
    ("no presets", "presets", [], ("presets: []", "at least one")),
    ("preset twice", "presets", ["heavy", "heavy"], ("presets", "each once")),
    ("unknown preset", "presets", ["", "huge"], ("presets: 'huge'", "no such preset", "heavy, light")),
    ("settings of no preset", "preset_settings", {"huge": {}}, ("preset_settings: 'huge'", "heavy, light")),
    ("bound of no preset", "compare.other_presets_db", {"huge": 1},
     ("other_presets_db: 'huge'", "heavy, light")),
    ("unknown section", "settings.estimatr", {}, ("settings.estimatr", "estimator, motion, mpc, schedule")),
    ("unknown setting", "settings.mpc.horizont", 20, ("settings.mpc.horizont", "unknown key")),
    ("unknown setting of a preset", "preset_settings.light.mpc", {"weight": 1.0}, ("light.mpc.weight",)),
    ("setting out of range", "settings.estimator", {"gate": -1},
     ("settings.estimator.gate: -1", "[2.0, 100.0]")),
    ("setting of a preset", "preset_settings.light.estimator.gate", 1,
     ("light.estimator.gate: 1", "[2.0, 100.0]")),
    ("setting of text", "settings.schedule.angle", "0.1 rad",
     ("settings.schedule.angle: '0.1 rad'", "is not a number")),
    ("NaN of a setting", "settings.schedule.angle", float("nan"), ("settings.schedule.angle: nan", "finite")),
    ("infinite setting", "settings.mpc.velocity_error", float("inf"), ("mpc.velocity_error: inf", "finite")),
    ("blocks too short", "settings.mpc.blocks", [2, 2],
     ("settings.mpc.blocks: [2, 2]", "sum to 4, not to horizon 20")),
    ("horizon alone", "settings.mpc", {"horizon": 21},
     ("settings.mpc.blocks: 'the default'", "not to horizon 21")),
    ("no such arm", "manipulator", "nobody", ("manipulator: 'nobody'", "single_link")),
    ("no such file", "manipulator", "nobody.yaml", ("manipulator: 'nobody.yaml'", "cannot be read")),
]  # fmt: skip


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "elbow.yaml").write_text(ARM.replace("upper: 180 deg}", LIMITS) + PRESETS, encoding="utf-8")
    return tmp_path


def read(folder: Path, key: str = "", value: Any = None) -> Task:
    """Read the moves file with one key changed."""
    content = copy.deepcopy({"manipulator": str(folder / "elbow.yaml"), **TASK})
    target = content
    *parents, last = key.split(".") if key else [""]
    for part in parents:
        target = target[part]
    if key:
        target[last] = value
    (folder / "moves.yaml").write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return task_for(str(folder / "moves.yaml"))


def test_the_file_itself_is_read_and_its_arm_can_do_it(folder: Path) -> None:
    task = read(folder)
    config = load_config(find_manipulator(task.manipulator))
    course = plan_course(StaticArm(ReducedTree(config, use_compiler=False)), task, 1 / config.rate_hz)
    assert [leg.name for leg in course.legs] == ["bend", "B", "along"]


@pytest.mark.parametrize("wrong", WRONG, ids=[wrong[0] for wrong in WRONG])
def test_what_is_wrong_is_refused_by_file_key_and_value(
    folder: Path, wrong: tuple[str, str, Any, tuple[str, ...]]
) -> None:
    _, key, value, expected = wrong
    with pytest.raises(ConfigError) as caught:
        read(folder, key, value)
    message = str(caught.value)
    assert message.startswith(f"{folder / 'moves.yaml'}: ")
    for words in expected:
        assert words in message, message


def test_a_key_given_twice_is_refused_by_line(folder: Path) -> None:
    read(folder)
    path = folder / "moves.yaml"
    path.write_text(path.read_text(encoding="utf-8") + "wait: 1 s\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=r"moves.yaml: line 1: key 'wait' is given twice"):
        task_for(str(path))


def test_a_shift_out_of_reach_is_refused_by_file_and_move(folder: Path) -> None:
    task = read(folder, "moves.along.shift", ["0 m", "0 m", "-4 m"])
    config = load_config(find_manipulator(task.manipulator))
    with pytest.raises(ConfigError) as caught:
        plan_course(StaticArm(ReducedTree(config, use_compiler=False)), task, 1 / config.rate_hz)
    assert str(caught.value).startswith(f"{folder / 'moves.yaml'}: moves.along: ")


NONSENSE = (
    None,
    True,
    float("nan"),
    float("inf"),
    "",
    "x",
    "-1",
    "nan s",
    "1 furlong",
    [],
    {},
    [None],
    {"a": {}},
)
SECTIONS = (
    "settings", "settings.mpc", "settings.schedule", "preset_settings", "preset_settings.light",
    "preset_settings.light.estimator", "compare", "compare.moves", "compare.other_presets_db",
)  # fmt: skip
DECIBELS = ("gain_db", "compare.worst_db", "compare.other_presets_db.heavy")
MEANT: dict[str, Any] = {  # nonsense that means something there
    **dict.fromkeys(SECTIONS, {}),
    **dict.fromkeys(DECIBELS, "-1"),
    "moves.along.keep_orientation": True,
    "assumed": [],
}


def keys(content: dict[str, Any], inside: str = "") -> Iterator[str]:
    for key, value in content.items():
        yield inside + key
        if isinstance(value, dict) and "by" not in value and key != "by":
            yield from keys(value, f"{inside}{key}.")


def test_moves_without_settings_say_that_those_of_the_nodes_are_tuned_for_no_arm(folder: Path) -> None:
    """MPC rested 17 mm off its goal, and the page told neither that nor whose settings they were."""
    assert UNTUNED not in read(folder, "assumed", []).assumed
    assert read(folder, "settings", {}).assumed == ("all of it", UNTUNED)


@pytest.mark.parametrize("key", list(keys(TASK)))
def test_nonsense_is_refused_by_file_and_key_wherever_it_stands(folder: Path, key: str) -> None:
    for value in NONSENSE:
        if key in MEANT and value == MEANT[key]:
            read(folder, key, value)
            continue
        with pytest.raises(ConfigError) as caught:
            read(folder, key, value)
        assert str(caught.value).startswith(f"{folder / 'moves.yaml'}: ")
        assert key.split(".")[0] in str(caught.value), (key, value)
