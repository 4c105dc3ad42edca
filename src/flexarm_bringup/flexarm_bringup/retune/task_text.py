"""A task as a moves file, for one that no file holds: the tour of an arm that nobody has tuned."""

from __future__ import annotations

import json

from flexarm_bringup.retune.moves_text import write_number
from flexarm_bringup.tasks.task import FORMAT, Task
from flexarm_bringup.tasks.task_moves import ByAxes, TaskMove, ToPose
from flexarm_model.motion.profiles import Trapezoid


def task_text(task: Task) -> str:
    """Return a moves file that says the same.

    Args:
        task: From home, moves by axes or to poses, on trapezoids.
    """
    watch = task.watch
    lines = [
        f"format: {FORMAT}",
        f"manipulator: {write_number(task.manipulator)}",
        f"lead: {task.lead!r} s",
        f"wait: {task.wait!r} s",
        f"watch: {{from: {watch.begin!r} s, to: {watch.end!r} s, below: {watch.cutoff_hz!r} Hz, "
        f"tolerance: {1e3 * watch.tolerance!r} mm}}",
        f"gain_db: {task.gain_db!r}",
        f"speed: {task.speed!r}",
        "moves:",
        *(f"  {json.dumps(name)}: {{{_move(move)}}}" for name, move in task.moves.items()),
        "settings:",
    ]
    for section, values in task.settings.items():
        if values:
            lines.append(f"  {section}:")
            lines += [f"    {name}: {write_number(value)}" for name, value in values.items()]
    lines += ["assumed:", *(f"  - {json.dumps(words)}" for words in task.assumed)]
    return "\n".join(lines) + "\n"


def _move(move: TaskMove) -> str:
    profile = move.profile
    assert isinstance(profile, Trapezoid)
    pace = f"duration: {profile.t_m!r} s, ramps: [{profile.t_a!r} s, {profile.t_d!r} s]"
    if isinstance(move, ToPose):
        return f"to: {json.dumps(move.pose)}, {pace}"
    assert isinstance(move, ByAxes)
    units = {"r": "rad", "t": "m"}
    ways = ", ".join(
        f"{json.dumps(axis)}: {float(way)!r} {units[axis.rpartition('.')[2][0]]}"
        for axis, way in move.distance.items()
    )
    return f"by: {{{ways}}}, {pace}"
