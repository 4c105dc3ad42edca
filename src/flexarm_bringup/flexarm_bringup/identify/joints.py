"""``flexarm identify SOURCE --joints``: friction, rotor inertia and gear stiffness from motion.

A source is a bag of a moving arm, a file of records with the same names, or the simulated rig, which is moved
for it.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from flexarm_bringup.drift_run.drives_alone import slowest
from flexarm_bringup.excite.rig_source import RIG, rig_settings
from flexarm_bringup.identify.joint_records import motion_of, not_used, read_motion
from flexarm_bringup.identify.measurement import SourceError
from flexarm_bringup.identify.slow_motion import move_rig
from flexarm_bringup.page.check import Check
from flexarm_bringup.page.report import Cells, Column, Page, Table
from flexarm_model.identification.joint_regression import (
    JointMotion,
    JointParameter,
    JointResult,
    identify_joints,
)
from flexarm_model.identification.rigid_limit import RigidLimit
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

CUTOFF = 0.2  # of the slowest mode: below it the arm is rigid to 4 %
DURATION = 30.0  # s
PERCENT = 100.0
EXPLAINED = 90.0  # % of a motor's torque; of arms as described 99, with friction beyond it 97
REMARKS = "Excitation"
HELD = "the torque counts as held from each sample to the next"
AT_THE_SAMPLES = "the torque counts as that at the sample; tell one that is held from it on by is_held = 1"


def joints_page(args: argparse.Namespace, say: Callable[[str], None]) -> Page:
    """Return what the sources say of the joints.

    Raises:
        SourceError: No manipulator is named, or the source cannot be used.
        ValueError: The arm is not an open one, or the motion is too short.
    """
    if not args.manipulator:
        raise SourceError("--joints needs --manipulator NAME: links and gravity come from its description")
    config = load_config(find_manipulator(args.manipulator), args.preset)
    RigidLimit(config, tuple(config.actuated))  # refuses loops and imported bodies before anything moves
    tree = ReducedTree(config)
    model = linearize(tree)
    cutoff_hz = CUTOFF * slowest(model, 1.0 / config.rate_hz) / (2 * np.pi)
    if args.files == [Path(RIG)]:
        motion, remarks = move_rig(config, model, rig_settings(args.perturb), DURATION, say), not_used(config)
    else:
        records = read_motion(args.files[0], config)
        motion, remarks = motion_of(records, config), [*records.remarks, *not_used(config, records.outputs)]
        if records.band_hz is not None and records.band_hz[0] >= cutoff_hz:
            band = f"its excitation begins at {records.band_hz[0]:.3g} Hz"
            remarks.append(f"{band}: --joints looks below {cutoff_hz:.3g} Hz, a fifth of the slowest mode")
    say("regression")
    result = identify_joints(config, motion, cutoff_hz, tree)
    told = zip(motion.axes, result.moving, strict=True)
    stands = [axis for axis, moving in told if axis in config.actuated and not moving]
    remarks += [f"{axis} stands: it tells neither inertia nor friction" for axis in stands]
    return build_page(config, motion, result, args.files, remarks)


def build_page(
    config: ManipulatorConfig,
    motion: JointMotion,
    result: JointResult,
    files: list[Path],
    remarks: Sequence[str] = (),
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
    notes = [
        f"condition number {result.condition:.3g} of the scaled regressor; 1 is best",
        f"least told: {result.weakest}",
        "± holds what bending of the arm as described adds, which the regression takes for rigid",
        HELD if motion.is_held else AT_THE_SAMPLES,
    ]
    quality = [
        Column("axis"), Column("torque\nexplained [%]", ".1f"), Column("moving\n[% of time]", ".0f"),
        Column("acceleration\n[SI RMS]", ".3g"),
    ]  # fmt: skip
    values = zip(motion.axes, result.fit, result.moving, result.acceleration, strict=True)
    suited: list[Cells] = [
        [a, float(f) if np.isfinite(f) else None, PERCENT * float(m), float(c)] for a, f, m, c in values
    ]
    named = ", ".join(path.name for path in files)
    lead = f"{named}: {len(motion.q) * motion.dt:.0f} s of {config.name} moving."
    items = [Table("Parameters of the joints", heads, rows, notes), Table(REMARKS, quality, suited, remarks)]
    return Page("Joints", lead, items, _checks(config, motion.axes, result))


def _checks(config: ManipulatorConfig, axes: Sequence[str], result: JointResult) -> list[Check]:
    """Return whether the parameters can be, whether anything moved, and whether they explain the torque."""
    impossible = [f"{p.axis} {p.name}" for p in result.parameters if p.is_impossible]
    told = zip(axes, result.fit, result.moving, strict=True)
    moved = [(axis, float(fit)) for axis, fit, moving in told if axis in config.actuated and moving > 0.0]
    poor = [(axis, fit) for axis, fit in moved if not fit >= EXPLAINED]
    found = [f"{axis} {fit:.1f} %" if np.isfinite(fit) else f"{axis} has no torque" for axis, fit in poor]
    names = ", ".join(axis for axis, _ in moved)
    return [
        Check("no parameter is found below zero", "none", ", ".join(impossible) or "none", not impossible),
        Check("motors that move", "one at least", names or "none", bool(moved)),
        Check("torque explained, of motors that move", f"at least {EXPLAINED:g} %",
              ", ".join(found) or f"{min((fit for _, fit in moved), default=0.0):.1f} %", not poor),
    ]  # fmt: skip


def _said(parameter: JointParameter) -> str:
    if parameter.is_impossible:
        return "tells what cannot be"
    return "tells it" if parameter.is_told else "does not tell it"
