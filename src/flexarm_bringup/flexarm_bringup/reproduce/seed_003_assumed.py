"""Seed 003: what the comparison assumes beside the robot's description, value by value.

The paper prints no number of its robot, so nothing here may stand unsaid: masses with their places and
inertias, poses, the path, the synthetic robots, the fit, the lines.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from flexarm_bringup.reproduce.seed_003_data import POSES, lines_hz, pose_of, robot
from flexarm_bringup.reproduce.seed_003_lap import ACCELERATION, CENTRE, NEAR, RADIUS, SIDE, SPEED
from flexarm_bringup.reproduce.seed_003_path import assumed_drives
from flexarm_bringup.reproduce.seed_003_robots import (
    BEARINGS,
    EVALUATIONS,
    FITTED_AT,
    GEARS,
    MODEL_DAMPING,
    PRIOR,
    ROBOT_DAMPING,
    SEEDS,
    STARTS,
)
from flexarm_model.manipulator.body_spec import Beam, RigidBody

DOUBLED = np.log(2.0)  # of a factor 2


def assumed_here() -> list[str]:
    """Return one line per group of assumed values, those of the description first."""
    poses = "; ".join(f"{pose} ({_texts(np.degrees(pose_of(pose)))})°" for pose in POSES)
    return [
        *robot().assumed,
        f"rigid bodies, centre of mass in their own frame, inertia about it: {'; '.join(_bodies())}",
        f"masses on the beams, distance from the beam's start, own inertia: {'; '.join(_point_masses())}",
        f"angles of the poses: {poses}",
        *_synthetic(),
        f"lines: {lines_hz().size} from 4 to 100 Hz at equal distances, all of one weight",
        *_path(),
        *assumed_drives(),
    ]


def _bodies() -> Iterator[str]:
    """Yield the rigid bodies that have a mass; rotors have none."""
    for name, body in robot().bodies.items():
        if isinstance(body, RigidBody) and body.mass > 0.0:
            inertia = np.diag(body.inertia)
            own = f"{inertia[0]:g}" if np.ptp(inertia) == 0.0 else f"({_texts(inertia)})"
            yield f"{name} {body.mass:g} kg at ({_texts(body.com)}) m, {own} kg m²"


def _point_masses() -> Iterator[str]:
    for name, body in robot().bodies.items():
        for part in body.point_masses if isinstance(body, Beam) else ():
            yield f"{name}, {part.name} {part.mass:g} kg at {part.at:.4g} m, {part.inertia:g} kg m²"


def _synthetic() -> list[str]:
    """Return how the synthetic robots are drawn and how the lumped model is fitted to them."""
    return [
        f"synthetic robots, seeds {_texts(SEEDS)}: every gear × {GEARS[0]:g} to {GEARS[1]:g}, every bearing "
        f"× {BEARINGS[0]:g} to {BEARINGS[1]:g} in all its directions, drawn uniformly, damping "
        f"{ROBOT_DAMPING:g} s × stiffness; links as in CB-1000",
        f"fit of the lumped model at {FITTED_AT}: least squares in decibels, prior of a factor 2 on each "
        f"stiffness against {PRIOR * DOUBLED:.0f} dB on each entry, damping {MODEL_DAMPING:g} s × stiffness, "
        f"starts {_texts(STARTS)} × datasheet, of which the one that leaves least is taken, at most "
        f"{EVALUATIONS} evaluations each",
    ]


def _path() -> list[str]:
    """Return the path of the flange; its speed alone is the paper's."""
    x, y, z = CENTRE
    return [
        f"path test: flange on a square of {SIDE:.2f} m centred at ({x:g}, {y:g}, {z:.2f}) m, corners of "
        f"radius {RADIUS:g} m, {ACCELERATION:g} m/s² there and at both ends, tool down; one lap at "
        f"{1e3 * SPEED:.0f} mm/s, which is printed; of the arm's eight postures the one nearest to "
        f"({_texts(np.degrees(NEAR))})°",
    ]


def _texts(values: object) -> str:
    return ", ".join(f"{value:.6g}" for value in np.asarray(values, dtype=float) + 0.0)
