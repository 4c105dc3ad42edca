"""The drawn mechanism stands where the dynamics says it stands."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

from flexarm_bringup.model_view.mechanism_figure import (
    SHARE,
    best_views,
    mode_figure,
    mode_shape,
    modes_figure,
)
from flexarm_bringup.model_view.mechanism_lines import MechanismLines, all_points, axis_transform
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

ARMS = Path(__file__).parents[2] / "flexarm_model/test/arms"


@cache
def tree(name: str) -> ReducedTree:
    path = find_manipulator(name) if name == "single_link" else ARMS / f"{name}.yaml"
    return ReducedTree(load_config(path), use_compiler=False)


@pytest.mark.parametrize("name", ["single_link", "planar", "spatial", "spatial_rigid"])
def test_the_drawn_tip_is_where_the_dynamics_has_it(name: str) -> None:
    lines, arm = MechanismLines(tree(name)), tree(name)
    for q in np.random.default_rng(1).uniform(-0.1, 0.1, (20, arm.n_q)):
        at = arm.tip_pose(q)  # of stiff modes 0.1 is much: hundreds of metres
        assert lines.tip(q) == pytest.approx(at, abs=1e-12 * max(1.0, abs(at).max()))  # round-off


def test_a_beam_ends_in_its_node_and_its_ends_follow_the_exact_cantilever() -> None:
    arm = tree("single_link")
    model = linearize(arm)
    at, moved = (
        next(line.points for line in lines if line.body == "strip")
        for lines in (
            MechanismLines(arm).lines(model.q0),
            MechanismLines(arm).displaced(model.q0, model.Phi[:, 1], 1e-3),
        )
    )
    assert at[0] == pytest.approx([0.010, 0, 0]) and at[-1] == pytest.approx([0.640, 0, 0])
    [row] = [i for i, name in enumerate(model.outputs.names) if name == "tip.ty"]
    assert moved[-1, 1] == pytest.approx(1e-3 * model.outputs.C_pos[row, 1], rel=1e-6)
    assert moved[0] == pytest.approx(at[0], abs=1e-12)  # clamped


def test_displacements_are_linear_however_large_they_are_drawn() -> None:
    arm = tree("spatial")
    model, lines = linearize(arm), MechanismLines(tree("spatial"))
    rest = all_points(lines.lines(model.q0))
    one, two = (all_points(lines.displaced(model.q0, model.Phi[:, 3], s)) - rest for s in (0.5, 1.0))
    assert two == pytest.approx(2 * one, abs=1e-9)


def test_the_largest_displacement_drawn_is_a_share_of_the_size() -> None:
    arm = tree("planar")
    model = linearize(arm)
    shape = mode_shape(MechanismLines(arm), model.q0, model.Phi[:, 2])
    rest, there, back = (all_points(lines) for lines in (shape.rest, shape.there, shape.back))
    assert np.linalg.norm(there - rest, axis=1).max() == pytest.approx(SHARE * np.ptp(rest, axis=0).max())
    assert there + back == pytest.approx(2 * rest, abs=1e-9)


def test_an_axis_turns_as_its_exponential() -> None:
    for i, name in enumerate(("rx", "ry", "rz")):
        e = np.eye(3)[i]
        turn = np.cross(np.eye(3), e)  # its rows are e_i x e, so it is e x
        assert axis_transform(name, 0.7)[:3, :3] == pytest.approx(expm(0.7 * turn), abs=1e-12)


def test_a_planar_arm_is_seen_from_above_and_a_spatial_one_from_two_sides() -> None:
    model = linearize(tree("planar"))
    shape = mode_shape(MechanismLines(tree("planar")), model.q0, model.Phi[:, 2])
    assert best_views(shape.rest, shape.there) == [(0, 1)]
    model = linearize(tree("spatial"))
    shape = mode_shape(MechanismLines(tree("spatial")), model.q0, model.Phi[:, 3])
    assert len(best_views(shape.rest, shape.there)) == 2


def test_drawings_are_made_without_a_display() -> None:
    model = linearize(tree("spatial"))
    shape = mode_shape(MechanismLines(tree("spatial")), model.q0, model.Phi[:, 3])
    assert mode_figure(shape, "mode 1", "The first mode.").svg.startswith("<svg")
    assert modes_figure([shape] * 4, ["1", "2", "3", "4"], "Four.").svg.count("<path") > 20
