"""An arm with an imported body, written with its files."""

from pathlib import Path

import numpy as np

from flexarm_model.fe_import.hexahedra import Material, make_solid, write_solid

ARM = """
format: flexarm/1
name: solid
source: made up for the tests
gravity: [0 m/s^2, 0 m/s^2, 0 m/s^2]
bodies:
  solid:
    type: imported
    mass: {{file: {0}mass.mtx}}
    stiffness: {{file: {0}stiffness.mtx}}
    nodes: {0}nodes.csv
    rows: {0}rows.txt
    units: {{length: m, mass: kg}}
    interfaces: {{root: {{set: {0}root.txt, kind: rigid}}}}
    damping_ratio: 1 %
    reduction: {{method: craig_bampton, modes: 3}}
joints:
  base: {{parent: world, child: solid.root, axes: {{rz: {{actuated: true}}}}}}
tip: solid.root
served: {{modes: 2, home: [0 deg], rate: 200 Hz}}
"""


def write_arm(path: Path, meshes: str = "") -> Path:
    """Write the arm and, into the folder ``meshes`` beside it, the files of its body; return ``path``."""
    folder = path.parent / meshes
    path.parent.mkdir(parents=True, exist_ok=True)
    folder.mkdir(parents=True, exist_ok=True)
    material = Material(70e9, 0.3, 2700.0)
    solid = make_solid(np.ones((4, 1, 1), dtype=bool), np.array([0.05, 0.01, 0.02]), material)
    write_solid(solid, folder, {"root": solid.select(lambda x: x[0] < 1e-9)})
    places = [(i + 1, axis) for i in range(len(solid.x)) for axis in ("UX", "UY", "UZ")]
    lines = [f"{row} {node} {axis}" for row, (node, axis) in enumerate(places, 1)]
    (folder / "rows.txt").write_text("\n".join(lines), encoding="utf8")
    path.write_text(ARM.format(meshes), encoding="utf8")
    return path
