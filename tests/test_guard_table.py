"""The table of the guard's limits in docs/guard.md is what the guard derives from the descriptions."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from flexarm_controller.guard_settings import GuardSettings, guard_limits
from flexarm_controller.guarding.limits import GuardLimits
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.tree.reduced_tree import ReducedTree

TABLE = Path(__file__).resolve().parents[1] / "docs" / "guard.md"
HEAD = "| machine | tau_max | a_s | peak | a | b | r | strain limit | E |"
ROUNDED = 0.05  # the table has two to four digits: 0.08 stands for 0.077


def rows() -> dict[tuple[str, str], list[str]]:
    lines = iter(TABLE.read_text(encoding="utf-8").split(HEAD)[1].splitlines()[2:])
    found = {}
    for line in lines:
        if not line.startswith("|"):
            break
        name, *cells = (cell.strip() for cell in line.strip("|").split("|"))
        arm, *preset = re.findall(r"`(\w+)`", name)
        found[arm, "".join(preset)] = cells
    return found


def derived(arm: str, preset: str) -> GuardLimits:
    config = load_config(find_manipulator(arm), preset)
    return guard_limits(config, ReducedTree(config), GuardSettings())


@pytest.mark.slow
@pytest.mark.parametrize(("arm", "preset"), rows())
def test_the_table_is_what_the_guard_derives(arm: str, preset: str) -> None:
    limits = derived(arm, preset)
    braking = limits.braking
    a = [known.deceleration for known in limits.ranges]
    b = [known.margin for known in limits.ranges]
    wanted = (limits.effort, braking.deceleration, braking.peak, a, b, [braking.rate], (), [limits.energy])
    for cell, values in zip(rows()[arm, preset], wanted, strict=True):
        if values:
            told = [float(number) for number in cell.split(", ")]
            each = [min(told, key=lambda t, v=value: abs(t - v)) for value in values]  # equal axes once
            assert (told if len(told) == len(values) else each) == pytest.approx(list(values), rel=ROUNDED)
