"""The comparison behind the demo: every scheme on every motion, nominal and with frequency errors.

Open-loop schemes run on an ideal servo, each move from rest; the others are closed loops over a series of
moves out on the worst published profile and back on a shaped one. Jobs are independent and run on all cores.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexarm_bringup.closed_loop import LoopSettings, run_closed_loop
from flexarm_bringup.demo_run.motions import LEAD, Move, motions, out_and_back
from flexarm_bringup.parallel import run_parallel
from flexarm_bringup.record import Figures, RunRecord, judge
from flexarm_bringup.servo_run import run_servo
from flexarm_bringup.sim.rig import Rig, RigSettings
from flexarm_controller.settings import ControllerConfig
from flexarm_model.manipulator.body_spec import Beam
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator

ANGLES_DEG = (10.0, 30.0, 60.0)
SWEEP_ANGLE_DEG = 30.0
FREQUENCY_ERRORS = (-0.10, -0.05, 0.05, 0.10)
OPEN_LOOP = ("A", "B", "ZVD")
SERVO = "ideal servo"


@dataclass(frozen=True)
class Row:
    """One move under one scheme.

    Attributes:
        preset: Preset of the manipulator.
        law: "ideal servo", "lqr" or "mpc".
        motion: Name of the motion.
        angle_deg: Size of the move [deg].
        frequency_error: Real over described frequency, minus 1.
        where: "in process", "DDS lockstep" or "DDS real time".
        figures: What it is worth.
    """

    preset: str
    law: str
    motion: str
    angle_deg: float
    frequency_error: float
    where: str
    figures: Figures

    @property
    def scheme(self) -> str:
        """Name of the scheme, for people."""
        return f"{self.law.upper() if self.law != SERVO else SERVO}, {MOTION_NAMES[self.motion]}"


@dataclass(frozen=True)
class Outcome:
    """A row with what happened: the move and the ticks of its slot."""

    row: Row
    move: Move
    slot: RunRecord


MOTION_NAMES = {"A": "case A (worst trapezoid)", "B": "case B (best trapezoid)", "ZVD": "ZVD shaped"}


@dataclass(frozen=True)
class Job:
    """What one worker does: a closed-loop series, or all open-loop moves of one arm."""

    preset: str
    law: str
    angles_deg: tuple[float, ...]
    frequency_error: float
    manipulator: str = "single_link"


def jobs(presets: Sequence[str]) -> list[Job]:
    """Return everything there is to run; the open-loop rows do not depend on the hub."""
    conditions = [(ANGLES_DEG, 0.0), *(((SWEEP_ANGLE_DEG,), error) for error in FREQUENCY_ERRORS)]
    servo = [Job(presets[0], SERVO, angles, error) for angles, error in conditions]
    closed = [
        Job(preset, law, angles, error)
        for preset in presets
        for law in ("mpc", "lqr")
        for angles, error in conditions
    ]
    return servo + closed


def run_job(job: Job) -> list[Outcome]:
    """Run a job."""
    config = load_config(find_manipulator(job.manipulator), job.preset)
    simulation = RigSettings(frequency_scale=1.0 + job.frequency_error)
    angles = [float(np.radians(angle)) for angle in job.angles_deg]
    if job.law == SERVO:
        runs = list(_open_loop(config, simulation, angles))
    else:
        moves = out_and_back(angles, "A", "ZVD", motions(damping_ratio(config)))
        settings = LoopSettings(controller=ControllerConfig(law=job.law), rig=simulation)
        record = run_closed_loop(config, moves, settings)
        runs = [(move, record) for move in moves]
    return [outcome_of(job, move, record, "in process", tip_reach(config)) for move, record in runs]


def run_jobs(todo: Sequence[Job], done: Callable[[int, int], None]) -> list[Outcome]:
    """Run jobs in parallel processes; ``done`` is told after each how many of how many are done."""
    return run_parallel(run_job, todo, done)


def outcome_of(job: Job, move: Move, record: RunRecord, where: str, reach: float) -> Outcome:
    """Judge one move of a record."""
    angle_deg = round(float(np.degrees(move.angle)), 6)
    figures = judge(record, move, reach)
    row = Row(job.preset, job.law, move.motion, angle_deg, job.frequency_error, where, figures)
    return Outcome(row, move, record.between(move.start - 0.2, move.watch_end))


def tip_reach(config: ManipulatorConfig) -> float:
    """Return the distance of the unbent tip from the axis [m]."""
    tip, *_ = (body.nodes[config.tip.node] for name, body in config.bodies.items() if name == config.tip.body)
    root = next(joint for joint in config.joints if joint.child.body == config.tip.body).placement[0, 3]
    return (
        float(root + tip) if isinstance(config.bodies[config.tip.body], Beam) else float(np.linalg.norm(tip))
    )


def damping_ratio(config: ManipulatorConfig) -> float:
    """Return the damping ratio that a shaper may count on: that of the tip's body [1]."""
    body = config.bodies[config.tip.body]
    return body.damping_ratio if isinstance(body, Beam) else 0.0


def _open_loop(
    config: ManipulatorConfig, simulation: RigSettings, angles: Sequence[float]
) -> Iterator[tuple[Move, RunRecord]]:
    """Run every open-loop motion from rest, outwards."""
    plant, makers = Rig(config, simulation).plant, motions(damping_ratio(config))
    for motion in OPEN_LOOP:
        for angle in angles:
            move = replace(out_and_back([angle], motion, motion, makers)[0], start=LEAD)
            yield move, run_servo(Rig(config, simulation, plant), [move])
