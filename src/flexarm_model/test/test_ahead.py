"""What is made ahead is what is asked for: the same function, arm and settings, and each once."""

import sys
from dataclasses import dataclass
from types import ModuleType

import pytest

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.start_pose import starting_at
from flexarm_model.process.ahead import made, make_ahead
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator


@dataclass(frozen=True)
class Pace:
    rate: float = 1.0
    names: tuple[str, ...] = ()


class Slow:
    count = 0

    def __init__(self, arm: ManipulatorConfig, pace: Pace, epoch: int | None) -> None:
        Slow.count += 1
        self.arm, self.pace, self.epoch = arm, pace, epoch


@pytest.fixture
def module(monkeypatch: pytest.MonkeyPatch) -> str:
    node = ModuleType("slow_node")
    node.AHEAD = (Slow, Pace, None)  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "slow_node", node)
    monkeypatch.setattr("flexarm_model.process.ahead._MADE", [])
    Slow.count = 0
    return "slow_node"


def arm(preset: str = "geared") -> ManipulatorConfig:
    return load_config(find_manipulator("single_link"), preset)


LINE = ["slow_node", "--ros-args", "-r", "__node:=left", "-p", "preset:=geared", "-p", "rate:=2.0"]


def test_what_was_made_ahead_is_given_once(module: str) -> None:
    make_ahead(module, [*LINE, "-p", "names:=[a, b]"])
    pace = Pace(2.0, ("a", "b"))
    first = made(Slow, arm(), pace, None)
    assert Slow.count == 1 and first.pace == pace
    assert made(Slow, arm(), pace, None) is not first and Slow.count == 2


@pytest.mark.parametrize(
    ("config", "pace", "epoch"),
    [
        (arm("light_hub"), Pace(2.0), None),
        (starting_at(arm(), [0.3]), Pace(2.0), None),
        (arm(), Pace(2.1), None),
        (arm(), Pace(2.0), 0),
    ],
    ids=("preset", "start", "settings", "epoch"),
)
def test_anything_else_is_made_when_it_is_asked_for(
    module: str, config: ManipulatorConfig, pace: Pace, epoch: int | None
) -> None:
    make_ahead(module, LINE)
    got = made(Slow, config, pace, epoch)
    assert Slow.count == 2
    assert (got.arm, got.pace, got.epoch) == (config, pace, epoch)


def test_the_arm_starts_where_the_command_line_says(module: str) -> None:
    make_ahead(module, [*LINE, "-p", "start:=[0.3]"])
    assert made(Slow, starting_at(arm(), [0.3]), Pace(2.0), None).arm.home == [0.3]
    assert Slow.count == 1


def test_a_module_that_says_nothing_makes_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "quick_node", ModuleType("quick_node"))
    make_ahead("quick_node", ["quick_node", "--ros-args", "-p", "manipulator:=nowhere"])
