"""Is the estimator as good as it says, on an arm that is not its model? A closed loop, judged by the truth.

The plant is nonlinear, has more modes than the model and, where asked for, less stiffness; the arm does the
moves of ``flexarm sim`` under MPC. What counts begins with the first move, once the estimator has settled.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.closed_loop import LoopSettings, run_loop
from flexarm_bringup.consistency.nees import Band, Square, band, mean_of
from flexarm_bringup.consistency.observables import Deviation, Observables, TrueArm
from flexarm_bringup.residual import rms
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.rig import RigSettings
from flexarm_bringup.sim_run.study import loop_settings
from flexarm_bringup.static_arm import StaticArm
from flexarm_bringup.tasks.course import Course, plan_course
from flexarm_bringup.tasks.task import Task
from flexarm_estimator.estimate import Estimate
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.start_pose import starting_at
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.served.model_schedule import ModelSchedule, periods_between_looks
from flexarm_model.tree.reduced_tree import ReducedTree
from flexarm_model.tree.sensors import output_names

Array = NDArray[np.float64]
LAW = "mpc"
NOMINAL, SOFT = "as described", "stiffness -30 %"
CONDITIONS = {NOMINAL: RigSettings(), SOFT: RigSettings(frequency_scale=float(np.sqrt(0.7)))}


@dataclass(frozen=True)
class RigJob:
    """A machine's task, what is wrong with the arm, the noise's seed; a label, the machine's if empty."""

    task: Task
    condition: str
    seed: int = 1
    label: str = ""


@dataclass(frozen=True)
class Innovations:
    """What a sensor's innovations were worth.

    Attributes:
        mean: Of the normalised square, per channel [1].
        band: Where it lies by chance when the filter is right.
        refused: Share of the samples that the gate refused [1].
    """

    mean: float
    band: Band
    refused: float


@dataclass(frozen=True)
class RigResult:
    """One run.

    Attributes:
        name, condition: Which.
        nees: Of axes, tip pose and strain together [1].
        by_kind: Of each of them alone [1].
        tip: RMS distance of the tip from the estimate [m].
        tip_sigma: RMS of what the estimate says of it [m].
        sensors: By name.
        usable: Share of the steps whose estimate was "ok" or "degraded" [1].
    """

    name: str
    condition: str
    nees: float
    by_kind: Mapping[str, float]
    tip: float
    tip_sigma: float
    sensors: Mapping[str, Innovations]
    usable: float


def run_rig_job(job: RigJob) -> list[RigResult]:
    """Run a job and judge it."""
    task = job.task
    config = load_config(find_manipulator(task.manipulator), task.presets[0])
    course = plan_course(StaticArm(ReducedTree(config)), task, 1 / config.rate_hz)
    config = starting_at(config, course.home)
    settings = loop_settings(task, LAW, replace(CONDITIONS[job.condition], seed=job.seed))
    hardware = Hardware(config, settings.rig)
    witness = Witness(config)
    run_loop(hardware, ReducedTree(config), course.reference, course.end, settings, witness.observe)
    judged = witness.judge(course, settings, task.lead)
    squares = [deviation.square() for deviation in judged]
    estimates = [estimate for estimate in witness.estimates if estimate.t >= task.lead]
    return [
        RigResult(
            name=job.label or task.manipulator,
            condition=job.condition,
            nees=mean_of(squares),
            by_kind=_by_kind(judged),
            tip=rms([deviation.tip for deviation in judged]),
            tip_sigma=rms([deviation.tip_sigma for deviation in judged]),
            sensors=read_innovations(estimates),
            usable=float(np.mean([estimate.is_usable for estimate in estimates])),
        )
    ]


class Witness:
    """Sees estimate and truth at every tick.

    Attributes:
        estimates: Of every tick.
    """

    def __init__(self, config: ManipulatorConfig) -> None:
        """Look at the strain gauges of a manipulator."""
        self._config = config
        names = output_names(config)
        sensors = {spec.name for spec in config.sensors if spec.kind == "strain_gauge"}
        self._rows = [i for i, name in enumerate(names) if name.split(".")[0] in sensors]
        self._gauges = [names[i] for i in self._rows]
        self.estimates: list[Estimate] = []
        self._truths: list[TrueArm] = []

    def observe(self, hardware: Hardware, estimate: Estimate) -> Mapping[str, Array]:
        """Keep a tick."""
        plant = hardware.rig.plant
        self.estimates.append(estimate)
        self._truths.append(TrueArm(plant.theta.copy(), plant.tip_pose(), plant.outputs()[self._rows]))
        return {}

    def judge(self, course: Course, settings: LoopSettings, start: float) -> list[Deviation]:
        """Return how far every estimate from ``start`` [s] on was off."""
        tree = ReducedTree(self._config)
        served = self._served(tree, course, settings)
        _, observables = next(served)
        following = next(served, None)
        deviations = []
        for estimate, truth in zip(self.estimates, self._truths, strict=True):
            while following is not None and following[0] <= estimate.t + _SAME:
                observables, following = following[1], next(served, None)
            if estimate.t >= start:
                deviations.append(observables.compare(truth, estimate.x, estimate.P, estimate.layout.w))
        return deviations

    def _served(
        self, tree: ReducedTree, course: Course, settings: LoopSettings
    ) -> Iterator[tuple[float, Observables]]:
        """Return the models that the loop uses, and from when on each [s]."""
        config = self._config
        period_ns = round(1e9 / config.rate_hz)
        model = linearize(tree)
        yield 0.0, Observables(model, tree, self._gauges, settings.estimator)
        schedule = ModelSchedule(tree, config, course.reference, settings.schedule)
        every = periods_between_looks(period_ns * 1e-9)
        for t_ns, later in schedule.plan(model, course.end, every * period_ns):
            yield t_ns * 1e-9, Observables(later, tree, self._gauges, settings.estimator)


_SAME = 1e-6  # s


def read_innovations(estimates: Sequence[Estimate]) -> dict[str, Innovations]:
    """Return what the innovations of every sensor were worth, as the estimates told it step by step."""
    seen: dict[str, list[Square]] = {report.name: [] for report in estimates[0].sensors}
    for before, after in zip(estimates[:-1], estimates[1:], strict=True):
        for old, new in zip(before.sensors, after.sensors, strict=True):
            if new.accepted + new.rejected > old.accepted + old.rejected:
                size = new.innovation.size
                seen[new.name].append(Square(size * new.normalised**2, size))
    refused = {
        new.name: (new.rejected - old.rejected) / max(len(seen[new.name]), 1)
        for old, new in zip(estimates[0].sensors, estimates[-1].sensors, strict=True)
    }
    return {
        name: Innovations(mean_of(squares), band(sum(square.rank for square in squares)), refused[name])
        for name, squares in seen.items()
        if squares
    }


def _by_kind(deviations: Sequence[Deviation]) -> dict[str, float]:
    found: dict[str, list[Square]] = {}
    for deviation in deviations:
        for kind, square in deviation.squares().items():
            found.setdefault(kind, []).append(square)
    return {kind: mean_of(squares) for kind, squares in found.items()}
