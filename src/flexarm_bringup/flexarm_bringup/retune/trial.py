"""Before and after on the simulated rig: old description and settings against new ones, on the same arm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from flexarm_bringup.margins.loop import Loop
from flexarm_bringup.margins.study import worst_of
from flexarm_bringup.retune.bench import Bench, Settings, together
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.tasks.task import Task
from flexarm_bringup.tip_vibration import Residual
from flexarm_controller.settings import ControllerConfig
from flexarm_model.manipulator.description import ManipulatorConfig

SEEDS = (1, 2, 3)  # of the noise; nothing was chosen by them


@dataclass(frozen=True)
class Trial:
    """What a description with its settings is worth on an arm.

    Attributes:
        residual: Of all moves of all runs together: RMS accelerations and distances, longest settling.
        tracking: Largest distance of the tip from where the reference wants it [m].
        stopped: Why the guard stopped the arm, or a state that was lost; empty when all went well.
        runs: Residual acceleration of every run, each with noise of its own [m/s^2].
        margins: Smallest gain [dB] and delay [s] margin of every path, as this description has the arm.
        trouble: What of the margins falls short; empty when nothing does.
    """

    residual: Residual
    tracking: float
    stopped: str
    runs: tuple[float, ...]
    margins: Mapping[str, tuple[float, float]]
    trouble: str


def run_trial(  # noqa: PLR0913, two descriptions, two of what belongs to each
    known: ManipulatorConfig,
    settings: Settings,
    task: Task,
    real: ManipulatorConfig,
    rig: RigSettings | None = None,
    seeds: Sequence[int] = SEEDS,
) -> Trial:
    """Let an arm do its moves, once with each noise; every run is a cold start.

    Args:
        known: The description that estimator and controller have.
        settings: Theirs.
        task: The moves.
        real: What the rig is made of.
        rig: What else differs on the rig.
        seeds: Of the noise.

    Raises:
        ValueError: The arm cannot do the moves.
    """
    bench = Bench(known, task, real, rig)
    found = [bench.run(settings, seed) for seed in seeds]
    margins, trouble = _margins(known, settings, task)
    return Trial(
        together(tuple(left for one in found for left in one.residuals)),
        max(one.tracking for one in found),
        next((one.stopped for one in found if one.stopped), ""),
        tuple(one.residual.acceleration for one in found),
        margins,
        trouble,
    )


def not_learning(settings: Settings) -> Settings:
    """Return the same settings for a law that uses its description as it is."""
    return settings[0], replace(settings[1], stiffness_step=0.0, inertia_step=0.0)


def _margins(
    known: ManipulatorConfig, settings: Settings, task: Task
) -> tuple[dict[str, tuple[float, float]], str]:
    loop = Loop(known, settings[0], (task.make("controller", ControllerConfig), settings[1]))
    cases = loop.cases()
    names = dict.fromkeys(margin.name for case in cases for margin in case.margins)
    worst = {name: worst_of(cases, name) for name in names}
    found = {
        name: (pair[0].margin(name).gain.decibels, pair[1].margin(name).delay)
        for name, pair in worst.items()
        if pair is not None
    }
    return found, loop.judge()
