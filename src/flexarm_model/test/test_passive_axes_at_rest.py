"""Damping ratios hold where axes without motor rest, and where these start is asked in loops alone."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from arms import FOLDER
from scipy.linalg import eigh
from scipy.optimize import brentq

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.loop_joints import joints_in_loops, passive_axes_outside_loops
from flexarm_model.reading.config import load_config
from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.served.linearize import linearize
from flexarm_model.settings.strict_yaml import ConfigError
from flexarm_model.tree.reduced_tree import ReducedTree

ZETA = 0.01
ROD = {
    "type": "rigid", "mass": "2 kg", "com": ["0.3 m", "0 m", "0 m"],
    "inertia": ["1e-3 kg m^2", "0.01 kg m^2", "0.01 kg m^2"] + ["0 kg m^2"] * 3,
}  # fmt: skip
BEAM = f"""
format: flexarm/1
name: hung
source: made up for a test
gravity: [0 m/s^2, 0 m/s^2, -9.81 m/s^2]
bodies:
  beam:
    type: beam
    pieces:
      - length: 1 m
        section: {{shape: rectangle, along_y: 40 mm, along_z: 20 mm}}
        youngs_modulus: 70 GPa
        density: 2700 kg/m^3
        elements: 8
    deformation: [bend_z]
    damping_ratio: {ZETA}
    nodes: {{end: 1 m}}
    reduction: {{method: craig_bampton, modes: 4}}
joints:
  base: {{parent: world, child: beam.root, axes: {{rz: {{actuated: true, rotor_inertia: 1 kg m^2}}}}}}
tip: beam.end
served: {{modes: 3, home: [0 deg], rate: 500 Hz}}
"""


def with_rod(
    folder: Path, axis: dict[str, Any], text: str = BEAM, parent: str = "beam.end", way: str = "ry"
) -> ManipulatorConfig:
    """Return an arm with a rod on one more axis."""
    content = yaml.safe_load(text)
    content["bodies"]["rod"] = ROD
    content["joints"]["hinge"] = {"parent": parent, "child": "rod.root", "axes": {way: axis}}
    (path := folder / "arm.yaml").write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return load_config(path)


def ratios(tree: ReducedTree | SegmentTree, q: np.ndarray, Z: np.ndarray) -> np.ndarray:
    """Return the ratios of the modes without weight at q in the motions Z; pendulums have none."""
    value, Phi = eigh(Z.T @ tree.K @ Z, Z.T @ tree.mass_matrix(q) @ Z)
    value, Phi = value[value > 1e-6 * value[-1]], (Z @ Phi)[:, value > 1e-6 * value[-1]]
    return np.asarray(np.diag(Phi.T @ tree.D @ Phi) / (2 * np.sqrt(value)))


def test_a_beam_before_a_hanging_rod_has_the_ratio_that_is_said_of_it(tmp_path: Path) -> None:
    """At the zero of the hinge, where the rod stands out, modes 2 and 3 got 0.49 and 0.84 %."""
    model = linearize(ReducedTree(with_rod(tmp_path, {}), use_compiler=False))
    assert np.degrees(model.q0[1]) == pytest.approx(89.6, abs=0.1)
    assert model.zeta[0] < 1e-4 * ZETA  # the pendulum strains next to nothing
    assert model.zeta[1:] == pytest.approx([ZETA, ZETA], rel=1e-3)  # the beam's sag turns its root by 0.4 deg


@pytest.mark.parametrize("axis", [{}, {"stiffness": "5 N m/rad", "damping_ratio": ZETA}])
@pytest.mark.parametrize(
    "build", [partial(ReducedTree, use_compiler=False), partial(SegmentTree, n_segments=6)]
)
def test_both_trees_damp_the_modes_where_free_and_sprung_axes_rest(
    tmp_path: Path, axis: dict[str, Any], build: Callable[[ManipulatorConfig], ReducedTree | SegmentTree]
) -> None:
    tree = build(with_rod(tmp_path, axis))
    weight, lever, stiffness = 2.0 * 9.81, 0.3, 5.0 if axis else 0.0
    angle = brentq(lambda at: stiffness * at - weight * lever * np.cos(at), 0.0, 2.0)
    assert angle > np.radians(30.0)
    q = np.zeros(tree.n_q)
    q[list(tree.axis_names).index("hinge.ry") if isinstance(tree, ReducedTree) else tree.axes["hinge.ry"]] = (
        angle
    )
    zeta = ratios(tree, q, np.delete(np.eye(tree.n_q), tree.actuated, axis=1))
    assert zeta == pytest.approx(np.full(zeta.size, ZETA), rel=1e-6)


def test_a_rod_that_hangs_from_a_loop_leaves_its_beams_their_ratio(tmp_path: Path) -> None:
    """The motor holds the loop, which bends alone, and with it the rod at the middle of its coupler."""
    content = yaml.safe_load((FOLDER / "four_bar.yaml").read_text(encoding="utf-8"))
    for name in ("coupler", "rocker"):
        content["bodies"][name]["damping_ratio"] = ZETA
    content["bodies"]["coupler"]["nodes"]["middle"] = "125 mm"
    content["bodies"]["coupler"]["reduction"] = {"method": "craig_bampton", "modes": 4}
    content["joints"]["pin"] = content["joints"].pop("hinge")
    config = with_rod(tmp_path, {}, yaml.safe_dump(content), "coupler.middle", "rz")
    assert passive_axes_outside_loops(config) == ["hinge.rz"]
    assert joints_in_loops(config.joints, config.closures) == {"base", "elbow", "pivot", "pin"}
    tree = ReducedTree(config, use_compiler=False)
    q = tree.loops.home.copy()
    turned = q[[tree.axis_names.index("base.rz"), tree.axis_names.index("elbow.rz")]].sum()
    q[tree.axis_names.index("hinge.rz")] = -np.pi / 2 - turned
    zeta = ratios(tree, q, tree.motions_within(q)[:, 1:])
    assert zeta == pytest.approx(
        np.full(zeta.size, ZETA), rel=1e-3
    )  # at the zero of the hinge the first one is a quarter


def test_where_nothing_pulls_a_free_axis_stands_at_zero(tmp_path: Path) -> None:
    """What is worked out there is not what is said where the rod hangs."""
    tree = ReducedTree(with_rod(tmp_path, {}, BEAM.replace("-9.81", "0")), use_compiler=False)
    q, Z = np.zeros(tree.n_q), np.delete(np.eye(tree.n_q), tree.actuated, axis=1)
    zeta = ratios(tree, q, Z)
    assert zeta == pytest.approx(np.full(zeta.size, ZETA), rel=1e-6)
    q[tree.axis_names.index("hinge.ry")] = np.pi / 2
    print("damping of a hanging rod's beam from where it stands out [%]:", 100 * ratios(tree, q, Z)[:2])
    assert ratios(tree, q, Z)[0] == pytest.approx(0.5 * ZETA, rel=0.05)


@pytest.mark.parametrize("axis", [{"guess": "0 deg"}, {"guess": "60 deg", "stiffness": "5 N m/rad"}])
def test_a_guess_outside_loops_is_refused_by_key(tmp_path: Path, axis: dict[str, Any]) -> None:
    with pytest.raises(ConfigError) as caught:
        with_rod(tmp_path, axis)
    assert f"joints.hinge.axes.ry.guess: '{axis['guess']}': has no effect" in str(caught.value)
    assert "it is of an axis in a loop, and 'hinge' is in none" in str(caught.value)


def test_two_legs_on_one_mast_leave_the_mast_outside_their_loop(tmp_path: Path) -> None:
    """What two ways from the world have in common is in no loop."""
    content = yaml.safe_load(BEAM)
    for name in ("leg", "foot"):
        content["bodies"][name] = ROD
    content["joints"] |= {
        "hip": {"parent": "beam.end", "child": "leg.root", "axes": {"rz": {"guess": "5 deg"}}},
        "ankle": {"parent": "leg.root", "child": "foot.root", "axes": {"rz": {"guess": "5 deg"}}},
        "back": {"parent": "beam.end", "child": "foot.root", "axes": {"rz": {"guess": "5 deg"}}},
    }
    (path := tmp_path / "arm.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    config = load_config(path)
    assert joints_in_loops(config.joints, config.closures) == {"hip", "ankle", "back"}
