"""What ``flexarm model`` says of a served model: modes, shapes, who sees them, who drives them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from flexarm_bringup.model_view.mode_words import describe_mode
from flexarm_bringup.page.figures import Figure
from flexarm_bringup.page.report import Cell, Cells, Column, Page, Table
from flexarm_model.bodies.few_modes import describe_few_modes
from flexarm_model.bodies.stocky import describe_stocky
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.odd_materials import describe_odd_materials
from flexarm_model.manipulator.sensor_kinds import SENSOR_KINDS
from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.modal.candidates import candidate_config, noise, sample_rates
from flexarm_model.modal.energy_shares import EnergyShares, energy_shares
from flexarm_model.modal.modes import model_modes
from flexarm_model.modal.observability import TIP_AMPLITUDE, ModeReach, Reach, Swing, mode_reach, tip_energy
from flexarm_model.served.axial_loads import describe_axial_loads
from flexarm_model.served.bent_bodies import describe_bent
from flexarm_model.served.control_rate import describe_rate
from flexarm_model.served.gauge_modes import describe_gauge_modes
from flexarm_model.served.mode_following import alikeness
from flexarm_model.served.reduced_model import Outputs, ReducedModel
from flexarm_model.served.tip_moves import are_felt
from flexarm_model.settings.units import RAD_PER_HZ
from flexarm_model.tree.reduced_tree import ReducedTree
from flexarm_model.tree.sensors import output_names, output_units

NAMED = 2  # sensors or motors per cell
PERCENT = 100.0
TRIED = {  # ordinary MEMS sensors, where none of their kind is mounted; noise in m/s^2 and rad/s
    kind: SensorSpec(kind, kind, "hand.held", ("x", "y", "z"), np.full(3, sigma))
    for kind, sigma in (("accelerometer", 0.03), ("gyroscope", 2e-3))
}
SEEN_LATER = "over a period"  # of modes that no single sample shows
PUSH = 1.0  # N m or N, for axes without a limit


@dataclass(frozen=True)
class Analysis:
    """A model and all that is said of it.

    Attributes:
        config: The description.
        tree: Its dynamics.
        model: Served at the pose asked for.
        home: Served at home.
        shares: Where the modes store their energy.
        reach: Who sees and who drives them.
        notes: What had to be supposed.
    """

    config: ManipulatorConfig
    tree: ReducedTree
    model: ReducedModel
    home: ReducedModel
    shares: EnergyShares
    reach: ModeReach
    notes: tuple[str, ...]


def analyse(tree: ReducedTree, model: ReducedModel, home: ReducedModel) -> Analysis:
    """Return everything there is to say of a model.

    Args:
        tree: Its dynamics.
        model: At the pose asked for.
        home: At the home pose.
    """
    config = tree.config
    effort, unlimited = np.array([axis.effort for axis in config.actuated.values()]), []
    for i, name in enumerate(config.actuated):
        if not np.isfinite(effort[i]):
            effort[i] = PUSH
            unlimited.append(name)
    notes = [f"{', '.join(unlimited)}: no effort limit given, {PUSH:g} N m or N taken"] if unlimited else []
    mounted = {sensor.kind for sensor in config.sensors}
    extra = [sensor for kind, sensor in TRIED.items() if kind not in mounted]
    for sensor in extra:
        unit = next(iter(SENSOR_KINDS[sensor.kind].units(sensor.site).values())).replace("^2", "²")
        told = f"one of {sensor.sigma[0]:g} {unit} is tried at every node"
        notes.append(f"no {sensor.kind} is mounted: {told}")
    candidates = candidate_config(config, extra)
    possible = _outputs(candidates, model), noise(candidates)
    swing = Swing(energy=tip_energy(model), rates=sample_rates(config))
    reach = mode_reach(model, noise(config), effort, possible, swing)
    notes.insert(0, _measure(reach, swing, is_felt=are_felt(model)))
    return Analysis(config, tree, model, home, energy_shares(tree, model), reach, tuple(notes))


def build_page(analysis: Analysis, figures: Sequence[Figure] = ()) -> Page:
    """Return the page; figures, if any, stand behind the table of modes."""
    config, model = analysis.config, analysis.model
    preset = f", preset {config.preset}" if config.preset else ""
    pose = ", ".join(
        f"{name} = {value:.6g}" for name, value in zip(model.theta_names, model.pose, strict=True)
    )
    title = f"{config.name}{preset}: model {model.model_id}"
    lead = (
        f"Served at {pose}; {model.n_eta} modes with the actuated axes held; {analysis.tree.n_q} coordinates."
    )
    items: list[Table | Figure] = [mode_table(analysis), *figures, *mac_tables(analysis)]
    items.append(reach_table(analysis))
    remarks: dict[str, Sequence[str]] = {"Source": (config.source,)} if config.source else {}
    suspicions = *describe_odd_materials(config.bodies), *describe_stocky(config.bodies)
    suspicions = *suspicions, *describe_few_modes(config), *describe_gauge_modes(config, model)
    suspicions = *suspicions, *describe_bent(analysis.tree, model.q0)
    if suspicions := (*suspicions, *describe_axial_loads(analysis.tree, model)):
        remarks["suspicions"] = suspicions
    return Page(
        title,
        lead,
        items,
        remarks=remarks,
        data=_data(analysis),
    )


def mode_table(analysis: Analysis) -> Table:
    """Return frequencies, damping and shapes in words."""
    model = analysis.model
    columns = [Column("mode", ".0f"), Column("f [Hz]", ".5g"), Column("ζ [%]", ".3g"), Column("shape")]
    rows: list[Cells] = [
        [
            k + 1,
            model.omega[k] / RAD_PER_HZ,
            PERCENT * model.zeta[k],
            describe_mode(model, analysis.shares, k),
        ]
        for k in range(model.n_eta)
    ]
    free = model_modes(model, locked=False).f_hz
    elastic = ", ".join(f"{f:.5g}" for f in free[free > 1e-6 * free.max(initial=0.0)])
    notes = [
        "Percent of the strain energy; tip in its own axes, per unit of the mass-normalised coordinate.",
        f"With the axes free to recoil: {elastic} Hz.",
        *(f"{text[0].upper()}{text[1:]}." for text in describe_rate(analysis.config.rate_hz, model.omega)),
    ]
    return Table("Modes with the actuated axes held", columns, rows, notes if model.n_eta else ())


def mac_tables(analysis: Analysis) -> list[Table]:
    """Return the modes here against those at home; none at home itself."""
    model, home = analysis.model, analysis.home
    if not model.n_eta or np.array_equal(model.pose, home.pose):
        return []
    values = alikeness(analysis.tree, home, model)
    columns = [Column("mode here", ".0f"), Column("f [Hz]", ".5g")]
    columns += [
        Column(f"home {i + 1}\n{home.omega[i] / RAD_PER_HZ:.4g} Hz", ".2f") for i in range(home.n_eta)
    ]
    rows: list[Cells] = [
        [k + 1, model.omega[k] / RAD_PER_HZ, *(float(value) for value in values[:, k])]
        for k in range(model.n_eta)
    ]
    note = "Weighted with the strain energy, which does not depend on the pose; 1 is the same shape."
    return [Table("MAC with the modes at home", columns, rows, [note])]


def reach_table(analysis: Analysis) -> Table:
    """Return who sees every mode, who could, and who drives it."""
    reach = analysis.reach
    titles = ["seen", "by (signal over noise)", "could be seen by", "driven", "by (times the swing)"]
    columns = [Column("mode", ".0f"), Column("f [Hz]", ".5g"), *(Column(title) for title in titles)]
    rows: list[Cells] = []
    for k in range(reach.modes.omega.size):
        seen, driven = _seen(reach, k), bool(reach.motors.reached[k])
        could: Cell = None if seen is True else _strongest(reach.possible, k)
        rows.append(
            [
                k + 1,
                reach.modes.f_hz[k],
                seen,
                _strongest(reach.over_period if seen == SEEN_LATER else reach.sensors, k),
                could or (None if seen else "no place with these sensors"),
                driven,
                _strongest(reach.motors, k),
            ]
        )
    later = (
        f"{SEEN_LATER[0].upper()}{SEEN_LATER[1:]}: what all samples of one period of the mode show, of which "
        "one shows less than its noise; an estimator that follows the mode for longer sees it better."
    )
    notes = [
        *analysis.notes,
        *([later] if any(row[2] == SEEN_LATER for row in rows) else []),
        "Close modes are judged together: a row that sees one of a double mode alone does not count.",
    ]
    return Table("Who sees and who drives each mode", columns, rows, notes)


def _seen(reach: ModeReach, mode: int) -> bool | str:
    """Return whether a mode is seen in one sample, or in all of a period."""
    return bool(reach.sensors.reached[mode]) or (bool(reach.over_period.reached[mode]) and SEEN_LATER)


def _measure(reach: ModeReach, swing: Swing, is_felt: bool) -> str:
    """Return the sentence that says what the table counts."""
    moved = f"with which the one that moves the tip most moves it {1e3 * TIP_AMPLITUDE:g} mm"
    return (
        f"Every mode swings with {swing.energy:.2g} J, {moved if is_felt else 'none moves the tip much'}: "
        "what one sample shows over its noise (seen from "
        f"{reach.sensors.enough:g}), and how far a motor at its limit pushes the mode, quasi-statically, in "
        f"times the swing (driven from {reach.motors.enough:g})."
    )


def _strongest(reach: Reach, mode: int) -> str | None:
    """Return the names that reach a mode with their share, strongest first; None when nothing does."""
    names = reach.by(mode)[:NAMED]
    if not names and reach.reached[mode]:
        return f"all together {reach.weakest[mode]:.3g}"
    return ", ".join(f"{name} {reach.share[mode, reach.names.index(name)]:.3g}" for name in names) or None


def _outputs(config: ManipulatorConfig, model: ReducedModel) -> Outputs:
    """Return the rows of other sensors in the coordinates of a model."""
    tree = ReducedTree(config, use_compiler=False)  # used once
    y0, *rows = (np.array(part) for part in tree.functions["output_rows"](model.q0))
    return Outputs(output_names(config), output_units(config), y0, *(row @ model.Phi for row in rows))


def _data(analysis: Analysis) -> dict[str, Any]:
    """Return what the JSON file holds beside the tables."""
    model, config = analysis.model, analysis.config
    shares = analysis.shares
    return {
        "model_id": model.model_id,
        "config_id": model.config_id,
        "manipulator": config.name,
        "preset": config.preset,
        "pose": dict(zip(model.theta_names, model.pose.tolist(), strict=True)),
        "f_hz": (model.omega / RAD_PER_HZ).tolist(),
        "zeta": model.zeta.tolist(),
        "energy_shares": [dict(zip(shares.names, share, strict=True)) for share in shares.share.tolist()],
    }
