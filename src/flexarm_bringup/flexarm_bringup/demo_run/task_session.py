"""The moves of a task as runs over DDS, judged like those in one process."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.demo_run.timekeeping import Timekeeping
from flexarm_bringup.processes.session import Session, SessionError, run_session
from flexarm_bringup.record import RunRecord
from flexarm_bringup.sim_run.study import LegResult, SimJob, SimResult, Trace, judge_leg
from flexarm_bringup.tasks.node_settings import node_settings
from flexarm_bringup.tasks.reference_file import from_rest, save_reference
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

Array = NDArray[np.float64]
LEAST_PREPARATION = 2.0  # s in real time between sending a reference and its start
SAME_PERIOD = 1e-6  # s by which stamps of a whole record may be unevenly spaced
MODEL_TIME = 0.1  # s that making a model, its filter and its program may take on a busy machine


@dataclass(frozen=True)
class TaskRun:
    """A finished run over DDS.

    Attributes:
        session: What was asked.
        preset, law: Which.
        legs: Every move.
        trace: What the tip did.
        guard: The guard's last words.
        kept: How the machine kept time.
    """

    session: Session
    preset: str
    law: str
    legs: tuple[LegResult, ...]
    trace: Trace
    guard: dict[str, Any]
    kept: Timekeeping = field(default_factory=Timekeeping)

    @property
    def where(self) -> str:
        """How it was run."""
        return "DDS lockstep" if self.session.lockstep else "DDS real time"

    @property
    def acceleration(self) -> float:
        """Residual of all moves together, RMS [m/s^2]."""
        return float(np.sqrt(np.mean([leg.residual.acceleration**2 for leg in self.legs])))

    @property
    def share_without_command(self) -> float:
        """Share of motor periods without a fresh command [1]."""
        return float(self.guard["ticks_without_command"] / max(self.guard["ticks"], 1))


def run_task_session(
    job: SimJob, twin: SimResult, lockstep: bool, folder: Path, domain: int, say: Callable[[str], None]
) -> TaskRun:
    """Do the moves of a job under one law with nodes.

    Args:
        job: Arm as described, and its moves.
        twin: The same in one process; tells the law and how many models are needed on the way.
        lockstep: By messages, or by the clock.
        folder: Gets reference, bag and logs.
        domain: ROS domain that nobody else uses.
        say: Told what is being waited for.

    Raises:
        SessionError, BagError: The run did not come to its end, or not all of it was in time.
    """
    folder.mkdir(parents=True)
    reference = folder / "reference.npz"
    save_reference(reference, from_rest(job.course.reference), job.course.end)
    session = Session(
        folder, job.preset, lockstep, (), "", "", task_settings(job, twin.law), job.task.manipulator,
        reference, LEAST_PREPARATION + MODEL_TIME * twin.effort.served,
    )  # fmt: skip
    record, guard = run_session(session, domain, say)
    if guard["reason"]:
        raise SessionError(f"guard stopped the arm: {guard['reason']}")
    config = load_config(find_manipulator(job.task.manipulator), job.preset)
    if np.ptp(np.diff(record.t)) > SAME_PERIOD:
        raise SessionError("the record has gaps: the computer is too busy for this rate in real time")
    trace = _trace(record, np.array([axis.effort for axis in config.actuated.values()]), job.course.end)
    legs = tuple(judge_leg(leg, trace, job) for leg in job.course.legs)
    return TaskRun(session, job.preset, twin.law, legs, trace, guard)


def task_settings(job: SimJob, law: str) -> dict[str, dict[str, Any]]:
    """Return the parameters of the nodes that are not defaults, by node."""
    settings = {"guard": {}, "rig": {}, **node_settings(job.task, job.preset)}
    for node in ("model", "guard", "rig"):
        settings[node]["start"] = tuple(map(float, job.course.home))
    settings["controller"]["law"] = law
    return settings


def torque_difference(run: TaskRun, twin: SimResult) -> float:
    """Return the largest difference of a torque in lockstep from that in one process, over its limit [1]."""
    n = min(run.trace.t.size, twin.trace.t.size)
    return float(abs(run.trace.load[:n] - twin.trace.load[:n]).max())


def _trace(record: RunRecord, limits: Array, end: float) -> Trace:
    kept = record.between(0.0, end)
    return Trace(kept.t, kept.tip[:, :3], kept.tau / limits)
