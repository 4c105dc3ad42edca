"""``flexarm identify SOURCE --joints``: friction, rotor inertia and gear stiffness from motion.

A source is a bag of a moving arm, a file of records with the same names, or the simulated rig, which is moved
for it: every axis by a few slow sines of its own frequencies, under joint PD on the drives.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.drift_run.drives_alone import drive_alone, slowest
from flexarm_bringup.excite.rig_source import RIG, rig_settings
from flexarm_bringup.identify.bag_source import read_bag
from flexarm_bringup.identify.measurement import COMMON, Records, SourceError
from flexarm_bringup.identify.sources import read_records
from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Page, Table
from flexarm_bringup.sim.rig import Rig, RigSettings
from flexarm_bringup.sim.sample import Sample
from flexarm_controller.reference import Reference
from flexarm_model.identification.joint_regression import (
    JointMotion,
    JointParameter,
    JointResult,
    identify_joints,
)
from flexarm_model.manipulator.description import Axis, ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
CUTOFF = 0.2  # of the slowest mode: below it the arm is rigid to 4 %
SLOWEST, FASTEST, SINES = 0.1, 1.0 / 8.0, 3  # Hz; of the slowest mode; per axis
STRIDE, SPEED, TORQUE = 0.3, 0.4, 0.3  # rad or m at most; shares of the limits of velocity and torque
LEAST_ROOM = 1e-3  # rad or m
DURATION = 30.0  # s
RAMP = 2.0  # s in which the sines begin
PERCENT = 100.0
REMARKS = "Excitation"


def joints_page(args: argparse.Namespace, say: Callable[[str], None]) -> Page:
    """Return what the sources say of the joints.

    Raises:
        SourceError: No manipulator is named, or the source cannot be used.
        ValueError: The arm is not an open one, or the motion is too short.
    """
    if not args.manipulator:
        raise SourceError("--joints needs --manipulator NAME: links and gravity come from its description")
    config = load_config(find_manipulator(args.manipulator), args.preset)
    tree = ReducedTree(config)
    model = linearize(tree)
    slowest_hz = slowest(model, 1.0 / config.rate_hz) / (2 * np.pi)
    if args.files == [Path(RIG)]:
        motion = move_rig(config, model, rig_settings(args.perturb), DURATION, say)
    else:
        motion = motion_of(_records(args.files[0], config), config)
    say("regression")
    return build_page(config, motion, identify_joints(config, motion, CUTOFF * slowest_hz, tree), args.files)


def motion_of(records: Records, config: ManipulatorConfig) -> JointMotion:
    """Return the motion in records whose outputs have the encoders' names and inputs the axes'.

    Raises:
        SourceError: There is no encoder among them, or no torque of a motor.
    """
    sites = {f"{spec.name}.position": spec.site for spec in config.sensors if spec.kind == "encoder"}
    found = {sites[name]: values for name, values in records.outputs.items() if name in sites}
    if not found:
        raise SourceError(f"no encoder was recorded: expected outputs {', '.join(sites) or 'of encoders'}")
    missing = [axis for axis in found if axis in config.actuated and axis not in records.inputs]
    if missing:
        there = ", ".join(records.inputs) or "none"
        raise SourceError(
            f"no torque of {', '.join(missing)} was recorded (in a table: 'in:{missing[0]}'); inputs: {there}"
        )
    length = next(iter(found.values())).size
    tau = [records.inputs.get(axis, np.zeros(length)) for axis in found]
    return JointMotion(
        tuple(found), np.column_stack(list(found.values())), np.column_stack(tau), 1 / records.rate_hz
    )


def move_rig(
    config: ManipulatorConfig,
    model: ReducedModel,
    settings: RigSettings,
    duration: float,
    say: Callable[[str], None],
) -> JointMotion:
    """Move the simulated rig and return what its encoders said.

    Args:
        config: The manipulator.
        model: Served at home.
        settings: How the rig differs.
        duration: Of the motion [s].
        say: Is told how far it is.

    Raises:
        SourceError: It has no motor or encoder, or a motor has no room at home.
    """
    sites = {spec.name: spec.site for spec in config.sensors if spec.kind == "encoder"}
    _refuse_stuck(config, sites)
    say("rig: building")
    rig = Rig(config, settings)
    rows: list[dict[str, float]] = []
    torques: list[Array] = []

    def hear(rig: Rig, samples: list[Sample], tau: Array) -> None:
        """Note what the encoders say, and the torque."""
        rows.append({s.sensor: float(s.y[0]) for s in samples if s.sensor in sites})
        torques.append(tau)
        if not rig.tick % round(1.0 / rig.dt):
            say(f"moving: {rig.tick * rig.dt:.0f} of {duration:.0f} s")

    drive_alone(rig, model, slow_sines(config, model, duration, rig.dt), duration, hear)
    q = np.array([[row[name] for name in sites] for row in rows])
    by_axis = dict(zip(config.actuated, np.array(torques[1:] + torques[-1:]).T, strict=True))
    tau = [by_axis.get(axis, np.zeros(len(q))) for axis in sites.values()]
    return JointMotion(tuple(sites.values()), q, np.column_stack(tau), rig.dt)


def _refuse_stuck(config: ManipulatorConfig, sites: Mapping[str, str]) -> None:
    """Refuse an arm that cannot be moved, or whose motion nobody measures."""
    if not config.actuated:
        raise SourceError(f"{config.name} has no motor: nothing moves its joints")
    if not sites:
        raise SourceError(f"{config.name} has no encoder: nobody measures how its joints move")
    for (name, axis), home in zip(config.actuated.items(), config.home, strict=True):
        if min(axis.upper - home, home - axis.lower) < LEAST_ROOM:
            raise SourceError(
                f"{name}: home at {home:.6g} leaves no room in {axis.lower:.6g} to {axis.upper:.6g}; "
                f"expected at least {LEAST_ROOM:g} rad or m on either side"
            )


def slow_sines(config: ManipulatorConfig, model: ReducedModel, duration: float, dt: float) -> Reference:
    """Return the reference: sines below the modes, of other frequencies for every axis, within its limits."""
    t = np.asarray(np.arange(0.0, duration + dt, dt), dtype=np.float64)
    highest = FASTEST * slowest(model, dt) / (2 * np.pi)
    count = SINES * model.n_theta
    f_hz = np.linspace(SLOWEST, max(highest, 2 * SLOWEST), count).reshape(SINES, model.n_theta)
    ramp = np.clip(t / RAMP, 0.0, 1.0)
    ramp = ramp**3 * (10 - 15 * ramp + 6 * ramp**2)
    theta = np.empty((t.size, model.n_theta))
    for k, axis in enumerate(config.actuated.values()):
        shape = ramp * np.sin(2 * np.pi * np.outer(t, f_hz[:, k]) + np.arange(SINES)).sum(axis=1)
        shape -= shape[0]
        theta[:, k] = (
            config.home[k] + _amplitude(axis, shape, dt, float(model.M[k, k]), config.home[k]) * shape
        )
    theta_dot: Array = np.asarray(np.gradient(theta, dt, axis=0), dtype=np.float64)
    theta_ddot: Array = np.asarray(np.gradient(theta_dot, dt, axis=0), dtype=np.float64)
    return Reference(t, theta, theta_dot, theta_ddot)


def _amplitude(axis: Axis, shape: Array, dt: float, inertia: float, home: float) -> float:
    """Return the factor that keeps range, speed and torque of an axis."""
    room = min(axis.upper - home, home - axis.lower, 2 * STRIDE) / 2
    speed = np.gradient(shape, dt)
    return float(
        min(
            room / abs(shape).max(),
            SPEED * axis.velocity / abs(speed).max(),
            TORQUE * axis.effort / (inertia * abs(np.gradient(speed, dt)).max()),
        )
    )


def build_page(
    config: ManipulatorConfig, motion: JointMotion, result: JointResult, files: list[Path]
) -> Page:
    """Return the parameters, and how well the motion was suited."""
    heads = [
        Column("axis"), Column("parameter"), Column("unit"), Column("described", ".4g"),
        Column("found", ".4g"), Column("±", ".2g"), Column("± before", ".2g"), Column("from bending", ".2g"),
        Column("the motion"),
    ]  # fmt: skip
    rows: list[Cells] = [
        [p.axis, p.name, p.unit, p.described, p.value if p.is_told else None, p.sigma, p.prior,
         p.bias, _said(p)]
        for p in result.parameters
    ]  # fmt: skip
    impossible = [f"{p.axis} {p.name}" for p in result.parameters if p.is_impossible]
    checks = [
        Check("no parameter is found below zero", "none", ", ".join(impossible) or "none", not impossible)
    ]
    notes = [
        f"condition number {result.condition:.3g} of the scaled regressor; 1 is best",
        f"least told: {result.weakest}",
        "± holds what bending of the arm as described adds, which the regression takes for rigid",
    ]
    quality = [
        Column("axis"), Column("torque\nexplained [%]", ".1f"), Column("moving\n[% of time]", ".0f"),
        Column("acceleration\n[SI RMS]", ".3g"),
    ]  # fmt: skip
    values = zip(motion.axes, result.fit, result.moving, result.acceleration, strict=True)
    suited: list[Cells] = [[a, float(f), PERCENT * float(m), float(c)] for a, f, m, c in values]
    named = ", ".join(path.name for path in files)
    lead = f"{named}: {len(motion.q) * motion.dt:.0f} s of {config.name} moving."
    items = [Table("Parameters of the joints", heads, rows, notes), Table(REMARKS, quality, suited)]
    return Page("Joints", lead, items, checks)


def _said(parameter: JointParameter) -> str:
    if parameter.is_impossible:
        return "tells what cannot be"
    return "tells it" if parameter.is_told else "does not tell it"


def _records(path: Path, config: ManipulatorConfig) -> Records:
    if path.is_dir():
        return read_bag(path, config, is_centred=False)  # weight and inertia are those of the pose
    records = read_records([path], COMMON)
    if len(records) != 1:
        raise SourceError(f"{path}: holds {len(records)} runs; --joints takes one")
    return records[0]
