"""How soft an arm is that nobody has tuned: learned of as many modes as the spill-over gate lets pass.

The law of a described arm shakes a softer one, so its stiffness is learned where a sensor feels how far it
bends. The estimator learns one error that the slowest modes have in common. A mode above them that is another
body's may be off the other way, and then the law is wrong about it by more than without: the gate says so.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from typing import Any

from numpy.linalg import LinAlgError

from flexarm_bringup.margins.loop import Loop
from flexarm_bringup.tasks.task import Task
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_estimator.settings import EstimatorConfig
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.settings.strict_yaml import ConfigError

MOST = 4  # modes that have an error in common
LEARNED: dict[str, dict[str, Any]] = {
    "estimator": {
        "stiffness_modes": MOST,
        "stiffness_error": 0.25,
        "stiffness_time": 5.0,  # s
        "stiffness_rest": 0.1,
        "frequency_error": 0.01,  # the rest of it is learned
    },
    "mpc": {"stiffness_step": 0.1},
}
FEEL = ("strain_gauge", "accelerometer", "gyroscope")  # encoders alone: 35 % were learned of their noise
UNFELT = "how soft it is is not: no gauge and no inertial sensor feels it bend"
RIGID = "how soft it is is not: no mode is served"
UNKEPT = "how soft it is is not: the law would shake a mode that is as described"


def learn_stiffness(task: Task, config: ManipulatorConfig) -> Task:
    """Return the task of an arm nobody has tuned with the settings that learn how soft it is.

    Args:
        task: Its settings learn nothing of the stiffness.
        config: The arm.
    """
    if not any(spec.kind in FEEL for spec in config.sensors):
        return _saying(task, UNFELT)
    if not config.modes:
        return _saying(task, RIGID)
    kept = (candidate for candidate in _candidates(task, config.modes) if is_kept(candidate, config))
    return next(kept, next(_candidates(task, config.modes)))  # where none is, the gate tells what helps


def is_kept(task: Task, config: ManipulatorConfig) -> bool:
    """Return whether the gate lets the arm move at home and at its named poses; one not judged passes."""
    laws = task.make("controller", ControllerConfig), task.make("mpc", MpcConfig)
    try:
        loop = Loop(config, task.make("estimator", EstimatorConfig), laws)
    except ConfigError:  # an arm that cannot be driven: whoever drives it says so, with its file
        return True
    for pose in (config.home, *config.poses.values()):
        with suppress(ValueError, LinAlgError):  # a pose that cannot be judged
            if loop.judge(pose):
                return False
    return True


def _candidates(task: Task, modes: int) -> Iterator[Task]:
    """Yield the task with ever fewer modes whose stiffness is learned, at last with none."""
    for count in range(min(MOST, modes), 0, -1):
        of_which = "" if count == min(MOST, modes) else f", by the slowest {count} of its {modes} modes"
        yield _with(_saying(task, f"how soft it is is learned{of_which}"), count)
    yield _saying(task, UNKEPT)


def _with(task: Task, count: int) -> Task:
    """Return a task that learns the stiffness of so many modes."""
    own = {"estimator": {**LEARNED["estimator"], "stiffness_modes": count}, "mpc": LEARNED["mpc"]}
    settings = {name: {**values, **own.get(name, {})} for name, values in task.settings.items()}
    return replace(task, settings=settings)


def _saying(task: Task, text: str) -> Task:
    """Return a task that assumes one thing more."""
    return replace(task, assumed=(*task.assumed, text))
