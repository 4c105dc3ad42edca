"""The damping that pages on papers rest on is the description's: another one is missed, and they say it."""

from __future__ import annotations

import re
from types import ModuleType

import pytest

from flexarm_bringup.page.check import Check
from flexarm_bringup.reproduce import seed_000_data, seed_000_modal_test, seed_001_machine, seed_002_data
from flexarm_bringup.reproduce.seed_000_data import load, read_published, serve
from flexarm_bringup.reproduce.seed_000_modal_test import peak_table, response_table, run_modal_test
from flexarm_bringup.reproduce.seed_001_machine import PRESETS, load_machine
from flexarm_bringup.reproduce.seed_001_presets import frequency_table
from flexarm_bringup.reproduce.seed_002_data import modal_data
from flexarm_bringup.reproduce.seed_002_shaping import measure_all, shaping_table
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

MORE_OR_LESS = re.compile(r"(\d+) % less to (\d+) % more")


def change(patch: pytest.MonkeyPatch, module: ModuleType, changes: dict[str, float]) -> None:
    """Make a module read descriptions with other values, by dotted path."""
    patch.setattr(module, "load_config", lambda path, preset: load_config(path, preset, changes))


def missed(checks: list[Check]) -> list[str]:
    return [check.name for check in checks if not check.passed]


def test_one_hundredth_more_damping_of_the_strip_is_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    change(monkeypatch, seed_002_data, {"bodies.strip.damping_ratio": 0.01515})
    modes = modal_data()
    table, checks = shaping_table(measure_all(modes), modes)
    assert missed(checks) == ["damping ratio of mode 1, as described", "C1A, the base: residual at exact f"]
    assert "ζ = 0.01515 are assumed" in table.notes[1]


def test_other_strips_of_the_3rrr_are_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(seed_000_modal_test, "TIMES", (1,))
    strips = [f"{strip}_{leg}" for strip in ("first", "second") for leg in "123"]
    change(monkeypatch, seed_000_data, {f"bodies.{strip}.damping_ratio": 0.011 for strip in strips})
    test = run_modal_test()
    table, checks = peak_table(test, serve(load()), read_published())
    assert missed(checks) == ["damping ratio of all modes at home, as described"]
    assert "ζ = 0.011 (assumed)" in table.notes[0]
    table, checks = response_table(test)
    assert "one response of the beam FE at seven lines" in missed(checks)
    assert table.title.endswith("ζ = 0.011")


def test_a_spring_of_the_3tpt_with_more_damping_is_missed(monkeypatch: pytest.MonkeyPatch) -> None:
    """It changes mode 1 alone, of which no printed reading tells."""
    change(monkeypatch, seed_001_machine, {"joints.constraint.axes.rx.damping_ratio": 0.015})
    _, checks = frequency_table({name: load_machine(name) for name in PRESETS})
    assert missed(checks) == [
        f"damping ratio of all modes of the {name} preset at home, as described" for name in PRESETS
    ]


@pytest.mark.parametrize(
    ("name", "presets", "poses"),
    [("planar_3rrr", ("",), ("A", "B")), ("spatial_3tpt", ("sim", "exp"), ("lateral", "centre"))],
)
def test_the_assumed_list_says_how_damping_differs_away_from_home(
    name: str, presets: tuple[str, ...], poses: tuple[str, ...]
) -> None:
    """It said that all modes have one ratio; `flexarm model --pose` printed others."""
    off = []
    for preset in presets:
        config = load_config(find_manipulator(name), preset)
        tree = ReducedTree(config, use_compiler=False)
        home = linearize(tree).zeta
        assert home == pytest.approx(home[0], rel=1e-5)
        off += [100 * (linearize(tree, config.poses[pose]).zeta / home - 1) for pose in poses]
    said = [found for line in config.assumed if (found := MORE_OR_LESS.search(line))]
    less, more = map(int, said[0].groups())
    assert (-less, more) == (round(min(map(min, off))), round(max(map(max, off))))
