"""The description brought in line with identified modes, and what came of it as tables."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.identify.mode_pairs import FITTED, is_same, match, match_again, strangers
from flexarm_bringup.identify.seen_shapes import SeenShapes, find_channels
from flexarm_bringup.page.report import Cells, Column, Page, Table
from flexarm_model.identification.described_arm import DescribedArm
from flexarm_model.identification.described_modes import described_modes, read_unknown
from flexarm_model.identification.described_shapes import described_shapes
from flexarm_model.identification.loose_directions import loose_directions
from flexarm_model.identification.modal_misfit import Serve
from flexarm_model.identification.mode_table import ModeTable
from flexarm_model.identification.model_update import FIT_ROUNDS, WIDER, Update, update_model
from flexarm_model.identification.pose_split import PoseTest, check_poses, split_poses
from flexarm_model.identification.unknown import Unknown
from flexarm_model.modal.fit import PoleFit
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.settings.strict_yaml import ConfigError

Array = NDArray[np.float64]
Say = Callable[[str], None]
SPREAD = 0.3  # one sigma of a parameter's relative error when nobody says [1]
PERCENT = 100.0
ROUNDS = 5  # of pairing modes and fitting, at most


@dataclass(frozen=True)
class Fitting:
    """What is fitted to what.

    Attributes:
        manipulator: Name or file.
        preset: Its preset.
        parameters: "PATH" or "PATH=SPREAD" each.
        pose: Actuated axes at the measurement [rad or m]; empty for home.
        motors_locked: They were held by brakes.
        output: File to write; None for none.
        outputs: Names of the measured outputs; those of the description's sensors tell shapes.
    """

    manipulator: str
    preset: str
    parameters: tuple[str, ...]
    pose: tuple[float, ...] = ()
    motors_locked: bool = False
    output: Path | None = None
    outputs: tuple[str, ...] = ()


def fit_description(
    fitting: Fitting, fit: PoleFit, others: Sequence[tuple[Array, PoleFit]] = (), say: Say = lambda text: None
) -> tuple[Update, PoseTest | None]:
    """Fit the parameters to the identified modes, and test them where there are poses to test them at.

    Args:
        fitting: What is fitted.
        fit: Modes at the fitting's pose.
        others: Other poses [rad or m], (n_theta,) each, and the modes there.
        say: Is told how many models were made so far.

    Raises:
        ValueError: A parameter does not exist, or no mode of the description is near an identified one.
    """
    path = find_manipulator(fitting.manipulator)
    pose = np.array(fitting.pose) if fitting.pose else load_config(path, fitting.preset).home

    def count(models: int) -> None:
        """Tell how many models were made."""
        say(f"fitting the description: model {models}")

    arm = DescribedArm(path, fitting.preset, fitting.motors_locked, count)
    modes_of = described_modes(path, fitting.preset, fitting.motors_locked, arm)
    unknowns = read_unknowns(fitting.manipulator, fitting.preset, fitting.parameters)
    first = [match(modes_of({}, at)[0], at, modes) for at, modes in [(pose, fit), *others]]
    at_sensors = seen_shapes(path, fitting, fit, arm)
    serve: Serve = modes_of if at_sensors is None else at_sensors.served(modes_of)
    tables = first
    for _ in range(ROUNDS):
        with_shapes = tables if at_sensors is None else [at_sensors.told(tables[0], fit), *tables[1:]]
        fitted, kept_back = split_poses(with_shapes)
        update = update_model(serve, unknowns, fitted)
        again = _paired_again(modes_of, update, tables, [fit, *(modes for _, modes in others)])
        if all(map(is_same, again, tables)) or not update.is_settled:
            break
        tables = again
    update = replace(update, strangers=strangers(first, tables))
    return update, check_poses(modes_of, update.changes, kept_back)


def _paired_again(
    modes_of: Serve, update: Update, tables: Sequence[ModeTable], fits: Sequence[PoleFit]
) -> list[ModeTable]:
    """Return the tables with the modes of the fitted description; as they are where that has no model."""
    found = []
    for table, fit in zip(tables, fits, strict=True):
        try:
            fitted_hz = modes_of(update.changes, table.pose)[0]
        except ValueError:  # at a pose kept back, where it is told
            found.append(table)
            continue
        found.append(match_again(fitted_hz, table, fit))
    return found


def read_unknowns(manipulator: str, preset: str, parameters: Sequence[str]) -> list[Unknown]:
    """Return the parameters, "PATH" or "PATH=SPREAD" each, as the description has them.

    Raises:
        ConfigError: There is no such value, it is no number or named twice, or its spread is none.
    """
    path, unknowns = find_manipulator(manipulator), list[Unknown]()
    for item in parameters:
        name, _, spread = item.partition("=")
        try:
            sigma = float(spread or SPREAD)
        except ValueError:
            sigma = 0.0
        if not 0.0 < sigma < math.inf:
            raise ConfigError(
                f"--fit {item}: '{spread}': expected a relative sigma above 0, such as {SPREAD}"
            )
        if name in {unknown.path for unknown in unknowns}:
            raise ConfigError(f"--fit {item}: '{name}' is named twice; expected every parameter once")
        unknowns.append(read_unknown(path, preset, name, sigma))
    return unknowns


def seen_shapes(path: Path, fitting: Fitting, fit: PoleFit, arm: DescribedArm) -> SeenShapes | None:
    """Return how shapes are to be compared; None where fewer than two outputs are the description's."""
    columns, names = find_channels(load_config(path, fitting.preset), fitting.outputs)
    if len(names) < 2 or fit.model.residues.shape[1] != len(fitting.outputs):
        return None
    return SeenShapes(described_shapes(path, fitting.preset, fitting.motors_locked, names, arm), columns)


def update_table(update: Update) -> Table:
    """Return the parameters before and after."""
    heads = [
        Column("parameter"), Column("before"), Column("after"), Column("change\n[%]", "+.2f"),
        Column("± [%]", ".2f"), Column("± before\n[%]", ".0f"), Column("the data"),
    ]  # fmt: skip
    rows: list[Cells] = []
    for i, unknown in enumerate(update.unknowns):
        told = unknown.path in update.changes
        rows.append([
            unknown.name, str(unknown.text(0.0)), str(unknown.text(update.x[i])) if told else "as before",
            PERCENT * float(np.expm1(update.x[i])), PERCENT * float(update.sigma[i]),
            PERCENT * unknown.spread, "tell it" if told else "do not tell it",
        ])  # fmt: skip
    notes = loose_directions(update)
    errors = "; ".join(
        f"{PERCENT * before:+.2f} % -> {PERCENT * after:+.2f} %"
        for before, after in zip(update.before, update.after, strict=True)
    )
    notes.append(f"frequencies, model over measured: {errors}")
    notes += [
        f"{f:.4g} Hz is no mode of the fitted description: none of it is within {PERCENT * FITTED:.0f} %"
        for f in update.strangers
    ]
    notes += [
        f"{unknown.name}: fitted as one, no mode measured here tells these equal parts apart"
        for unknown in update.unknowns
        if unknown.equals
    ]
    if update.misfit > WIDER:
        notes.append(
            f"the description cannot have these modes: {update.misfit:.2g} times as much is left as may be, "
            "and every ± is widened by that"
        )
    if not update.is_settled:
        notes.append(f"the fit still moved after {FIT_ROUNDS} rounds and was ended: name fewer parameters")
    notes += [f"stepped back from values without a model: {trial}" for trial in update.refused[-1:]]
    return Table("Description fitted to the modes", heads, rows, notes)


def sensitivity_table(update: Update) -> Table:
    """Return by how many per cent every frequency moves with one per cent of a parameter."""
    heads = [Column("frequency", "d"), *(Column(unknown.name, "+.3f") for unknown in update.unknowns)]
    rows: list[Cells] = [[i + 1, *map(float, row)] for i, row in enumerate(update.sensitivity)]
    return Table("Sensitivity: per cent of frequency per per cent of parameter", heads, rows)


def add_to(page: Page, update: Update, said: str, test: PoseTest | None = None) -> Page:
    """Return the page with the update, and what it is worth at poses kept back."""
    remarks = dict(page.remarks)
    if said:
        remarks["Written"] = [said]
    if test is not None:
        remarks["At poses kept back"] = [
            f"{test.poses} pose(s): frequencies {PERCENT * test.before:.2f} % off (RMS) as described, "
            f"{PERCENT * test.after:.2f} % as fitted"
            + ("" if test.holds else ": the fit does not hold there")
        ]
    items = [update_table(update), sensitivity_table(update), *page.items]
    return Page(page.title, page.lead, items, page.checks, remarks, page.data)
