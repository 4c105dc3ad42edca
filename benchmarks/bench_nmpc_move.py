"""A large fast move under the nonlinear and the linear predictive controller: what is left of it at the tip.

Every axis of three arms turns by 60 degrees in 1.3 times the shortest time in which its torques and
velocities can bring it to rest (linear program on the served model halfway). Both laws have the same
weights, limits, delay, served models on the way and noise; the plant is the simulated rig, which is
nonlinear and has more modes. The estimate is that of the linear or of the extended filter: the nonlinear
law belongs with the extended one, whose unmodelled torque is what the nonlinear motion does not explain.
The linear law also runs with the models that are to come ("foreseeing"), so that it knows how the arm
changes on the way; it is judged by the best of its four rows.

As a script it prints a table; with the argument "off" that of arms which are not as described instead.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.sim_run.study import CONDITIONS, NOMINAL, LegResult, run_sim_job, sim_jobs
from flexarm_bringup.tasks.task import Task
from flexarm_bringup.tasks.task_for import task_for
from flexarm_bringup.tasks.task_moves import ByAxes
from flexarm_bringup.tip_vibration import Watch
from flexarm_controller.limits import limits_of
from flexarm_controller.open_loop.rest_to_rest import RestToRest, fastest
from flexarm_model.motion.profiles import Trapezoid
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
SLOWER = 1.3  # than the time-optimal motion
LONGEST = 1.5  # s, in which the fastest motion is looked for
ANGLE = float(np.deg2rad(60.0))
WATCH = Watch(0.02, 2.1, 50.0, 5e-4)
WAIT = 2.5  # s
NEW_MODEL = 0.1  # rad that an axis turns until it is served anew
LAWS: Mapping[str, tuple[str, Mapping[str, float]]] = {  # name: law, settings of the predictive controllers
    "mpc": ("mpc", {}),
    "foreseeing": ("mpc", {"foresight": True, "stiffness_step": 0.0, "inertia_step": 0.0}),
    "nmpc": ("nmpc", {}),
}
FILTERS = ("linear", "extended")
MEASURES = ("residual_m_s2", "tip_rms_mm", "settling_s", "tracking_mm")


TWO_LINK = {  # scaled to modes from 4 Hz on; the filter bears 20 % of mass
    "mpc": {
        "position_error": 0.0092,
        "velocity_error": 0.088,
        "modal_energy": 1.2e-4,
        "modal_cutoff_hz": 17.0,
        "input_acceleration": 1.7,
        "input_jerk": 216.0,
    },
    "estimator": {"acceleration_error": 0.2, "disturbance_drift": 2.5},
}


@dataclass(frozen=True)
class Arm:
    """An arm and its move.

    Attributes:
        path: Name or file.
        signs: Which way every axis turns.
        ramp: Share of the time that the axes accelerate, and brake; what their velocity limits leave.
        settings: Of controller and estimator where the arm has no moves file: these alone, not what an arm
            that nobody has tuned gets beside them.
    """

    path: str
    signs: Mapping[str, float]
    ramp: float
    settings: Mapping[str, Mapping[str, float]] = field(default_factory=dict)


ARMS = {
    "single_link": Arm("single_link", {"base.rz": 1.0}, 1 / 3),
    "variable_stiffness": Arm(
        "variable_stiffness", {"base.ry": 1.0, "shoulder.rz": -1.0, "elbow.rz": 1.0}, 0.25
    ),
    "two_link": Arm(
        str(Path(__file__).with_name("two_link.yaml")), {"shoulder.rz": 1.0, "elbow.rz": 1.0}, 1 / 3, TWO_LINK
    ),
}


def shortest_time(arm: Arm) -> float:
    """Return the shortest time of the move from rest to rest [s].

    Raises:
        ValueError: It takes longer than ``LONGEST``.
    """
    description = load_config(find_manipulator(arm.path))
    home, way = np.array(description.home), ANGLE * np.array([arm.signs[a] for a in description.actuated])
    model, dt = linearize(ReducedTree(description), home + way / 2), 1 / description.rate_hz
    plan = fastest(RestToRest(model, limits_of(description), home, home + way, dt), round(LONGEST / dt))
    if plan is None:
        raise ValueError(f"{arm.path}: the move takes longer than {LONGEST} s")
    return plan.duration


def task_of(arm: Arm, duration: float, kind: str, changes: Mapping[str, float]) -> Task:
    """Return the move as a task with the arm's own settings.

    Args:
        arm: Which.
        duration: Of the move [s].
        kind: Of the filter.
        changes: Settings of the predictive controllers.
    """
    task = task_for(arm.path)
    profile = Trapezoid(1.0, duration, arm.ramp * duration, arm.ramp * duration)
    move = ByAxes({axis: sign * ANGLE for axis, sign in arm.signs.items()}, profile)
    settings = {name: dict(values) for name, values in (arm.settings or task.settings).items()}
    settings.setdefault("estimator", {})["filter"] = kind
    settings.setdefault("schedule", {})["angle"] = NEW_MODEL
    settings.setdefault("mpc", {}).update(changes)
    return replace(
        task, presets=("",), start="home", wait=WAIT, moves={"out": move}, watch=WATCH, settings=settings
    )


def run_arm(arm: Arm, duration: float) -> dict[str, LegResult]:
    """Return the results by law and filter."""
    found = {}
    for name, (law, changes) in LAWS.items():
        for kind in FILTERS:
            (job,) = sim_jobs(task_of(arm, duration, kind, changes), ("",), (NOMINAL,))
            (result,) = run_sim_job(replace(job, laws=(law,)))
            found[f"{name}_{kind}"] = result.legs[0]
    return found


def run_off(arm: Arm, duration: float) -> dict[str, tuple[LegResult, LegResult]]:
    """Return linear and nonlinear law, both with the extended filter, by what is wrong with the model."""
    (job,) = sim_jobs(task_of(arm, duration, "extended", {}), ("",), (NOMINAL,))
    found = {}
    for condition in CONDITIONS:
        linear, ours = run_sim_job(replace(job, condition=condition, laws=("mpc", "nmpc")))
        found[condition] = (linear.legs[0], ours.legs[0])
    return found


def main(arms: int = len(ARMS)) -> dict[str, float]:
    """Compare on the first ``arms``; returns residuals, and those of nmpc over the best of mpc."""
    results: dict[str, float] = {}
    for name, arm in list(ARMS.items())[:arms]:
        shortest = shortest_time(arm)
        results[f"{name}_time_optimal_s"] = shortest
        legs = run_arm(arm, SLOWER * shortest)
        for row, leg in legs.items():
            left = leg.residual
            results[f"{name}_{row}_residual_m_s2"] = left.acceleration
            results[f"{name}_{row}_tip_rms_mm"] = 1e3 * left.distance
            results[f"{name}_{row}_settling_s"] = float(np.clip(left.settling, 0.0, WATCH.end))
            results[f"{name}_{row}_tracking_mm"] = 1e3 * leg.tracking
        for measure in MEASURES:
            rows = [f"{law}_{kind}" for law in ("mpc", "foreseeing") for kind in FILTERS]
            linear = min(results[f"{name}_{row}_{measure}"] for row in rows)
            ratio = results[f"{name}_nmpc_extended_{measure}"] / max(linear, 1e-9)
            results[f"{name}_nmpc_to_mpc_{measure.split('_')[0]}_ratio"] = ratio
    return results


def print_table(results: Mapping[str, float]) -> None:
    """Print one row per law and filter, arm by arm."""
    print(f"{'law':12}{'filter':10}{'residual':>14}{'tip RMS':>10}{'settles':>9}{'off its path':>14}")
    for name in ARMS:
        print(f"{name}: 60 degrees in {SLOWER * results[f'{name}_time_optimal_s']:.3f} s")
        for law, kind in product(LAWS, FILTERS):
            values = [results[f"{name}_{law}_{kind}_{measure}"] for measure in MEASURES]
            texts = "{:9.3f} m/s2{:7.2f} mm{:7.3f} s{:11.2f} mm".format(*values)
            print(f"{law:12}{kind:10}{texts}")


def print_off() -> None:
    """Print what the laws leave where the arm is not as described: linear / nonlinear."""
    print(f"{'the arm is':18}{'residual m/s2':>18}{'tip RMS mm':>16}{'settles s':>18}{'off its path mm':>18}")
    for name, arm in ARMS.items():
        print(name)
        for condition, (linear, ours) in run_off(arm, SLOWER * shortest_time(arm)).items():
            pairs = [
                "{:8.3f} /{:6.3f}".format(*(leg.residual.acceleration for leg in (linear, ours))),
                "{:7.2f} /{:6.2f}".format(*(1e3 * leg.residual.distance for leg in (linear, ours))),
                "{:8.3f} /{:6.3f}".format(*(max(leg.residual.settling, 0) for leg in (linear, ours))),
                "{:8.2f} /{:6.2f}".format(*(1e3 * leg.tracking for leg in (linear, ours))),
            ]
            print(f"{condition:18}" + "  ".join(pairs))


if __name__ == "__main__":
    print_off() if sys.argv[1:] == ["off"] else print_table(main())
