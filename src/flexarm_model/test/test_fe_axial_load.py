"""What an imported body does not show: an axial load stiffens or softens it, up to buckling."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from fe_beams import RIGID, chain
from fe_bodies import description, ends
from test_trees_agree import locked

from flexarm_model.fe_import.hexahedra import write_solid
from flexarm_model.reading.config import load_config
from flexarm_model.served.linearize import find_equilibrium
from flexarm_model.tree.reduced_tree import ReducedTree

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


def slowest_hz(folder: Path, gravity: float, body: dict[str, Any] | None) -> float:
    """Return the slowest frequency [Hz] of a blade with 1 kg on its end: imported, or as given."""
    arm = description(interfaces=RIGID)
    if body is not None:
        arm["bodies"]["solid"] = body
    inertia = ["1e-4 kg m^2"] * 3 + ["0 kg m^2"] * 3
    arm["bodies"]["payload"] = {"type": "rigid", "mass": "1 kg", "inertia": inertia}
    arm["gravity"] = [f"{gravity} m/s^2", "0 m/s^2", "0 m/s^2"]
    arm["joints"]["base"] = {"parent": "world", "child": "solid.root", "axes": {"rz": {"actuated": True}}}
    arm["joints"]["flange"] = {"parent": "solid.end", "child": "payload.root"}
    arm["served"] = {"modes": 1, "home": ["0 deg"], "rate": "100 Hz"}
    blade = chain(np.full(N, LENGTH / N), np.full(N, THICK), HIGH)
    write_solid(blade, folder, ends(blade))
    path = folder / "arm.yaml"
    path.write_text(yaml.safe_dump(arm), encoding="utf-8")
    tree = ReducedTree(load_config(path), use_compiler=False)
    q, _ = find_equilibrium(tree, tree.config.home)
    M, _, K, _ = (np.array(part) for part in tree.linearisation(q))
    return float(locked(M, (K + K.T) / 2, tree.actuated, 1)[0] / (2 * np.pi))


def test_an_axial_load_changes_a_beam_and_no_imported_body(tmp_path: Path) -> None:
    """The figures of docs/imported_bodies.md."""
    loads = {"none": 0.0, "hanging": 9.81, "standing": -9.81}
    imported, beam = (
        {name: slowest_hz(tmp_path, g, body) for name, g in loads.items()} for body in (None, BEAM)
    )
    for name in loads:
        print(
            f"1 m x 3 mm blade with 1 kg, {name}: imported {imported[name]:.4f} Hz, beam {beam[name]:.4f} Hz"
        )
    assert list(imported.values()) == pytest.approx([0.6668] * 3, rel=1e-3)
    assert list(beam.values()) == pytest.approx([0.6668, 0.8643, 0.3715], rel=1e-3)
