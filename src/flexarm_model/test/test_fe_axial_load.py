"""What an imported body does not show: an axial load stiffens or softens it, up to buckling."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from fe_beams import RIGID, E, chain
from fe_bodies import block, description, ends, load_arm
from test_trees_agree import locked

from flexarm_model.bodies.sid_file import write_sid
from flexarm_model.fe_import.hexahedra import write_solid
from flexarm_model.reading.config import load_config
from flexarm_model.served.axial_loads import axial_shares, describe_axial_loads
from flexarm_model.served.linearize import find_equilibrium, linearize
from flexarm_model.tree.reduced_tree import ReducedTree

AXES = ("tx", "ty", "tz", "rx", "ry", "rz")
N, LENGTH, THICK, HIGH = 20, 1.0, 0.003, 0.04  # elements and size of the blade [m]
BEAM = {
    "type": "beam",
    "pieces": [
        {
            "length": "1 m",
            "section": {"shape": "rectangle", "along_y": "3 mm", "along_z": "40 mm"},
            "youngs_modulus": "70 GPa",
            "density": "2700 kg/m^3",
            "elements": N,
        }
    ],
    "deformation": ["bend_y"],
    "nodes": {"end": "1 m"},
    "damping_ratio": 0,
    "reduction": {"method": "craig_bampton", "modes": 5, "frame": "clamped"},
}


def blade_arm(
    folder: Path, gravity: float, body: dict[str, Any] | None, modes: int = 10, axis: int = 0
) -> ReducedTree:
    """Return a blade with 1 kg on its end: imported with so many modes, or as given."""
    arm = description(interfaces=RIGID)
    arm["bodies"]["solid"]["reduction"]["modes"] = modes
    if body is not None:
        arm["bodies"]["solid"] = body
    inertia = ["1e-4 kg m^2"] * 3 + ["0 kg m^2"] * 3
    arm["bodies"]["payload"] = {"type": "rigid", "mass": "1 kg", "inertia": inertia}
    arm["gravity"] = [f"{gravity * (k == axis)} m/s^2" for k in range(3)]
    arm["joints"]["base"] = {"parent": "world", "child": "solid.root", "axes": {"rz": {"actuated": True}}}
    arm["joints"]["flange"] = {"parent": "solid.end", "child": "payload.root"}
    arm["served"] = {"modes": 1, "home": ["0 deg"], "rate": "100 Hz"}
    blade = chain(np.full(N, LENGTH / N), np.full(N, THICK), HIGH)
    write_solid(blade, folder, ends(blade))
    path = folder / "arm.yaml"
    path.write_text(yaml.safe_dump(arm), encoding="utf-8")
    return ReducedTree(load_config(path), use_compiler=False)


def slowest_hz(tree: ReducedTree) -> float:
    """Return the slowest frequency of an arm at home [Hz]."""
    q, _ = find_equilibrium(tree, tree.config.home)
    M, _, K, _ = (np.array(part) for part in tree.linearisation(q))
    return float(locked(M, (K + K.T) / 2, tree.actuated, 1)[0] / (2 * np.pi))


def test_an_axial_load_changes_a_beam_and_no_imported_body(tmp_path: Path) -> None:
    """The figures of docs/imported_bodies.md."""
    loads = {"none": 0.0, "hanging": 9.81, "standing": -9.81}
    imported, beam = (
        {name: slowest_hz(blade_arm(tmp_path, g, body)) for name, g in loads.items()} for body in (None, BEAM)
    )
    for name in loads:
        print(
            f"1 m x 3 mm blade with 1 kg, {name}: imported {imported[name]:.4f} Hz, beam {beam[name]:.4f} Hz"
        )
    assert list(imported.values()) == pytest.approx([0.6668] * 3, rel=1e-3)
    assert list(beam.values()) == pytest.approx([0.6668, 0.8643, 0.3715], rel=1e-3)


@pytest.mark.parametrize(("gravity", "share"), [(9.81, 0.6801), (-9.81, -0.6897)])
def test_what_an_axial_load_would_change_is_estimated_and_told(
    gravity: float, share: float, tmp_path: Path
) -> None:
    """Of the beam above: squares of 0.8643 and 0.3715 Hz against that of 0.6668 Hz."""
    tree = blade_arm(tmp_path, gravity, None)
    model = linearize(tree)
    found = float(axial_shares(tree, model)["solid"][0])
    print(f"the estimate of its stiffness is {100 * found:+.0f} %, of the beam's {100 * share:+.0f} %")
    # half of the blade's own weight, a third of the payload's, is taken for a load on its end; a third is one
    assert found == pytest.approx(share, rel=0.07)
    (said,) = describe_axial_loads(tree, model)
    assert (
        f"what 'solid' bears at rest here would change the stiffness of mode 1 by about {100 * found:+.0f} %"
        in said
    )


def test_the_same_body_from_a_sid_file_is_told_and_a_beam_is_not(tmp_path: Path) -> None:
    """Without a word a standing blade had 0.667 Hz instead of 0.371: data may lack second-order fields."""
    imported = blade_arm(tmp_path, -9.81, None)
    write_sid(imported.bodies["solid"], tmp_path / "solid.sid")
    read = blade_arm(tmp_path, -9.81, {"type": "superelement", "file": "solid.sid"})
    told = [axial_shares(tree, linearize(tree))["solid"] for tree in (imported, read)]
    np.testing.assert_allclose(told[1], told[0], rtol=1e-4)
    assert describe_axial_loads(read, linearize(read))
    beam = blade_arm(tmp_path, -9.81, BEAM)
    assert axial_shares(beam, linearize(beam)) == {}


@pytest.mark.parametrize(("gravity", "modes", "axis"), [(0.0, 10, 0), (9.81, 10, 2), (9.81, 4, 0)])
def test_no_axial_load_is_told_where_there_is_none_or_no_mode_to_tell_it(
    gravity: float, modes: int, axis: int, tmp_path: Path
) -> None:
    tree = blade_arm(tmp_path, gravity, None, modes, axis)
    model = linearize(tree)
    assert axial_shares(tree, model)["solid"] == pytest.approx(0.0, abs=1e-6)
    assert describe_axial_loads(tree, model) == ()


def test_a_compact_casting_bears_its_load_without_a_word(tmp_path: Path) -> None:
    tree = ReducedTree(load_arm(tmp_path, block(4)), use_compiler=False)
    assert describe_axial_loads(tree, linearize(tree)) == ()


def test_leaves_that_guide_a_stage_are_judged_together(tmp_path: Path) -> None:
    """Of two guided leaves P adds P L^2 / (10 E I) of the stiffness of one, however they share it."""
    leaf = chain(np.full(8, 0.025), np.full(8, 1e-3), 0.02)
    write_solid(leaf, tmp_path, ends(leaf))
    body = {**description(interfaces=RIGID)["bodies"]["solid"], "reduction": {"method": "guyan"}}
    inertia = ["0.1 kg m^2"] * 3 + ["0 kg m^2"] * 3
    stage = {
        "type": "rigid",
        "mass": "10 kg",
        "inertia": inertia,
        "nodes": {"side": ["0 mm", "100 mm", "0 mm"]},
    }
    stiff = {axis: {"stiffness": f"1e7 {'N/m' if axis[0] == 't' else 'N m/rad'}"} for axis in AXES}
    arm = {
        **description(),
        "gravity": ["9.81 m/s^2", "0 m/s^2", "0 m/s^2"],
        "bodies": {"ground": stage, "left": body, "right": body, "stage": stage},
        "joints": {
            "rail": {"parent": "world", "child": "ground.root", "axes": {"ty": {"actuated": True}}},
            "left_root": {"parent": "ground.root", "child": "left.root"},
            "right_root": {"parent": "ground.side", "child": "right.root"},
            "left_end": {"parent": "left.end", "child": "stage.root"},
            "right_end": {"parent": "right.end", "child": "stage.side", "axes": stiff},
        },
        "tip": "stage.root",
        "served": {"modes": 1, "home": ["0 mm"], "rate": "200 Hz"},
    }
    path = tmp_path / "arm.yaml"
    path.write_text(yaml.safe_dump(arm), encoding="utf-8")
    tree = ReducedTree(load_config(path), use_compiler=False)
    shares = axial_shares(tree, linearize(tree))
    EI = E * 0.02 * 1e-3**3 / 12
    expected = 10 * 9.81 * 0.2**2 / (10 * EI) / 2
    assert shares["left"][0] + shares["right"][0] == pytest.approx(
        expected, rel=0.02
    )  # their own weight, too
