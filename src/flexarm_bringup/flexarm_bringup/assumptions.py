"""What figures of an arm rest on: what its description assumes, what was fitted. Silence is no answer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from flexarm_bringup.page.report import Page
from flexarm_bringup.tasks.task import Task
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

NONE = ("nothing",)


def rests_on(config: ManipulatorConfig) -> dict[str, Sequence[str]]:
    """Return the remarks that belong beside every result of an arm; "nothing" where there is none."""
    return {"assumed": config.assumed or NONE, "fitted": config.fitted or NONE}


def resting_on(page: Page, *arms: ManipulatorConfig) -> Page:
    """Return a page with what its figures rest on behind its other remarks.

    Args:
        page: As a command made it.
        arms: Those that it reports on; of several each says its name, and what is the same is said once.
    """
    told = list({(arm.name, arm.assumed, arm.fitted): arm for arm in arms}.values())
    names = [arm.name for arm in told]
    remarks = dict(page.remarks)
    for i, arm in enumerate(told):
        again = f" #{names[:i].count(arm.name) + 1}" if arm.name in names[:i] else ""
        whose = f" of {arm.name}{again}" if len(told) > 1 else ""
        remarks |= {f"{head}{whose}": lines for head, lines in rests_on(arm).items()}
    return replace(page, remarks=remarks)


def arm_of(task: Task, preset: str | None = None) -> ManipulatorConfig:
    """Return the arm of a task, with what the moves assume beside its description.

    Args:
        task: The task.
        preset: Of the description; None takes the first of the task.

    Raises:
        ConfigError: There is no such preset, or something is wrong with the description.
    """
    config = load_config(find_manipulator(task.manipulator), task.presets[0] if preset is None else preset)
    return replace(config, assumed=(*config.assumed, *task.assumed))
