"""The modes that values are fitted to are those served: with gravity, and with loops closed at the pose."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from flexarm_model.bodies import body_reduction
from flexarm_model.bodies.model_order import with_more_modes
from flexarm_model.bodies.superelement import Superelement
from flexarm_model.identification.described_arm import DescribedArm
from flexarm_model.identification.described_modes import described_modes, read_unknown
from flexarm_model.identification.mode_table import ModeTable
from flexarm_model.identification.model_update import update_model
from flexarm_model.manipulator.body_spec import Body
from flexarm_model.modal.modes import damped_poles, frequency_and_damping
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
HOME_3RRR = load_config(find_manipulator("planar_3rrr")).home
STIFFNESS = "bodies.strip.pieces.0.youngs_modulus"
COLUMN = """
format: flexarm/1
name: column
source: made up for the tests
gravity: [-9.81 m/s^2, 0 m/s^2, 0 m/s^2]
bodies:
  strip:
    type: beam
    pieces:
      - {length: 500 mm, section: {shape: rectangle, along_y: 4 mm, along_z: 20 mm}, youngs_modulus: 200 GPa,
         density: 1 kg/m^3, elements: 8}
    deformation: [bend_y]
    damping_ratio: 0.01
    nodes: {tip: 500 mm}
    point_masses: [{name: weight, at: 500 mm, mass: 4 kg}]
    reduction: {method: craig_bampton, modes: 3, frame: clamped}
joints:
  base: {parent: world, child: strip.root, axes: {ty: {actuated: true, rotor_inertia: 1 kg}}}
tip: strip.tip
served: {modes: 2, home: [0 m], rate: 200 Hz}
"""


@pytest.fixture
def column(tmp_path: Path) -> Path:
    path = tmp_path / "column.yaml"
    path.write_text(COLUMN, encoding="utf-8")
    return path


def test_a_column_near_its_buckling_load_tells_its_stiffness(column: Path) -> None:
    """At 19 % of its buckling load; without what the weight takes off, 163 GPa were found."""
    config = load_config(column)
    model = linearize(ReducedTree(config, use_compiler=False))
    f_hz, zeta = model.omega[:1] / (2 * np.pi), model.zeta[:1]
    table = ModeTable(config.home, f_hz, 1e-4 * f_hz, zeta, 0.1 * zeta)
    before = read_unknown(column, "", STIFFNESS, 0.3)
    start = type(before)(before.path, 230.0, before.unit, before.spread)
    update = update_model(described_modes(column, "", True), [start], [table])
    assert float(str(update.changes[STIFFNESS]).split()[0]) == pytest.approx(200.0, rel=1e-3)
    assert update.sensitivity[0, 0] == pytest.approx(0.5 / (1 - 0.19), rel=0.02)  # f^2 ~ E - 0.19 E_0


def poles_of_arm(
    name: str, more: int, pose: Array | None = None, locked: bool = False
) -> tuple[Array, Array]:
    """Return frequencies [Hz] and damping ratios of an arm with more modes in its bodies."""
    config = with_more_modes(load_config(find_manipulator(name)), more)
    tree = ReducedTree(config, use_compiler=False)
    model = linearize(tree, pose, tree.n_q - tree.loops.dependent.size - len(tree.actuated))
    kept = slice(model.n_theta if locked else 0, None)
    poles = damped_poles(*(matrix[kept, kept] for matrix in (model.M, model.D, model.K)))
    return frequency_and_damping(poles[poles.imag > 1.0])


@pytest.mark.parametrize("locked", [True, False])
@pytest.mark.parametrize("name", ["planar_3rrr", "spatial_3tpt", "variable_stiffness"])
def test_modes_are_the_poles_of_the_arm_at_every_pose(name: str, locked: bool) -> None:
    path = find_manipulator(name)
    config, serve = load_config(path), described_modes(path, "", locked)
    for pose in [config.home, *config.poses.values()][:3]:
        f_hz, zeta = poles_of_arm(name, 1, pose, locked)
        assert serve({}, pose)[0] == pytest.approx(f_hz, rel=1e-6)
        assert serve({}, pose)[1] == pytest.approx(zeta, rel=1e-4)


@pytest.mark.parametrize("name", ["planar_3rrr", "spatial_3tpt"])
def test_with_motors_locked_the_slowest_modes_are_the_served_ones(name: str) -> None:
    path = find_manipulator(name)
    config = load_config(path)
    model = linearize(ReducedTree(config, use_compiler=False))
    f_hz, zeta = described_modes(path, "", True)({}, config.home)
    assert f_hz[: model.n_eta] == pytest.approx(model.omega / (2 * np.pi), rel=5e-3)
    assert zeta[: model.n_eta] == pytest.approx(model.zeta, rel=2e-2)


def test_modes_of_motors_that_give_way_are_those_of_finer_bodies() -> None:
    """34.29 Hz were held against a rig of 33.56: a fit explained it with an elbow of hardly any mass."""
    (kept, _), (fine, zeta) = poles_of_arm("planar_3rrr", 0), poles_of_arm("planar_3rrr", 4)
    f_hz, ours = described_modes(find_manipulator("planar_3rrr"), "", False)({}, HOME_3RRR)
    assert kept[6:9] / fine[6:9] == pytest.approx(np.full(3, 1.022), abs=2e-3)
    assert f_hz[:9] == pytest.approx(fine[:9], rel=2e-3)
    assert ours[:9] == pytest.approx(zeta[:9], rel=2e-2)


def test_a_spring_damped_beyond_oscillation_is_no_mode() -> None:
    """Three springs with dampers: two of them creep, as the servos' angles do not."""
    arm = DescribedArm(find_manipulator("variable_stiffness"), "", False)
    modes = arm.modes({}, load_config(find_manipulator("variable_stiffness")).home)
    assert modes.omega.size == 1 and 0.5 < modes.zeta[0] < 0.7


def test_free_motors_add_no_mode_but_what_gravity_makes_of_them(column: Path) -> None:
    """A slide that nothing holds has none; the column moves with it."""
    home = np.zeros(1)
    locked, free = (DescribedArm(column, "", held).modes({}, home).omega for held in (True, False))
    assert locked.size == free.size and free[0] > locked[0]


def test_an_answer_that_was_given_is_given_again(column: Path) -> None:
    arm, home = DescribedArm(column, "", True), np.zeros(1)
    first = arm.modes({STIFFNESS: "210 GPa"}, home)
    arm.modes({}, home)
    assert arm.modes({STIFFNESS: "210 GPa"}, home) is first


def test_only_the_body_that_changes_is_reduced_again(column: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An imported body of the same arm would take its seconds in every trial."""
    reduced: list[str] = []

    def reduce(body: Body, interfaces: Collection[str]) -> Superelement:
        reduced.append(body.name)
        return body_reduction_before(body, interfaces)

    body_reduction_before = body_reduction.reduce_body
    monkeypatch.setattr(body_reduction, "reduce_body", reduce)
    text = column.read_text(encoding="utf-8").replace(
        "\nbodies:", "\nbodies:\n  hub: {type: rigid, mass: 2 kg}"
    )
    text = text.replace("parent: world, child: strip.root", "parent: world, child: hub.root")
    fixed = "\njoints:\n  weld: {parent: hub.root, child: strip.root}"
    column.write_text(text.replace("\njoints:", fixed), encoding="utf-8")
    home = np.zeros(1)
    kept = DescribedArm(column, "", True)
    for changes in ({}, {STIFFNESS: "210 GPa"}, {"bodies.hub.mass": "3 kg", STIFFNESS: "210 GPa"}):
        modes = kept.modes(changes, home)
    assert reduced == ["hub", "strip", "strip", "hub"]
    assert modes.omega == pytest.approx(DescribedArm(column, "", True).modes(changes, home).omega, rel=1e-15)


def test_an_update_steps_back_from_values_with_which_the_arm_buckles(column: Path) -> None:
    """Measured near its buckling load; the first step from afar goes beyond it, where no model is."""
    config, home = load_config(column, changes={STIFFNESS: "42 GPa"}), np.zeros(1)
    model = linearize(ReducedTree(config, use_compiler=False))
    f_hz, nan = model.omega[:1] / (2 * np.pi), np.full(1, np.nan)
    table = ModeTable(home, f_hz, 1e-4 * f_hz, nan, nan)
    update = update_model(
        described_modes(column, "", True), [read_unknown(column, "", STIFFNESS, 3.0)], [table]
    )
    assert float(str(update.changes[STIFFNESS]).split()[0]) == pytest.approx(42.0, rel=1e-3)
    assert update.refused and all(
        trial.startswith(f"{STIFFNESS} = ") and "no stable equilibrium" in trial for trial in update.refused
    )
