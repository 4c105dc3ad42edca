"""Cost of an imported body: from files to 350 modes, to a superelement, to a moving arm.

A solid angle of bricks with about 14,000 displacements is written to files as another program would (not
timed). Elapsed times; memory is the peak of the process (``ru_maxrss``) when a stage has ended, so each
figure holds those before it. A dense matrix of that size would take 1.6 GB by itself.
"""

from __future__ import annotations

import resource
import tempfile
import time
from pathlib import Path

import numpy as np

from flexarm_bringup.sim.plant import Plant
from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.fe_import.checks import check_model
from flexarm_model.fe_import.fe_model import load_model
from flexarm_model.fe_import.hexahedra import Material, make_solid, write_solid
from flexarm_model.fe_import.sparse_modes import lowest_modes
from flexarm_model.manipulator.imported_body import ImportedBody
from flexarm_model.reading.config import load_config

CELLS = (30, 12, 24)  # bricks along x, y, z of the box that the angle is cut from
EDGE = 0.015  # of a brick [m]
ALUMINIUM = Material(E=70e9, nu=0.33, density=2700.0)
TORQUE = 40.0  # on the axis [N m]
SHIFT = -((2 * np.pi * 300.0) ** 2)  # below the rigid modes [rad^2/s^2]

ARM = """
format: flexarm/1
name: casting
source: made up for the benchmark
gravity: [0 m/s^2, 0 m/s^2, -9.81 m/s^2]
bodies:
  casting:
    type: imported
    mass: {file: mass.mtx}
    stiffness: {file: stiffness.mtx}
    nodes: nodes.csv
    units: {length: m, mass: kg}
    interfaces: {root: {set: root.txt, kind: rigid}, flange: {set: flange.txt, kind: averaging}}
    damping_ratio: 1 %
    reduction: {method: craig_bampton, modes: 12}
  payload: {type: rigid, mass: 20 kg}
joints:
  base: {parent: world, child: casting.root, axes: {rz: {actuated: true, rotor_inertia: 10 kg m^2}}}
  weld: {parent: casting.flange, child: payload.root}
tip: payload.root
served: {modes: 4, home: [0 deg], rate: 200 Hz}
"""


class Stages:
    """Elapsed time and peak memory, stage by stage."""

    def __init__(self) -> None:
        """Start the clock."""
        self.figures: dict[str, float] = {}
        self._start = time.perf_counter()

    def end(self, name: str) -> None:
        """Take down the stage that ends here, and start the next."""
        self.figures[f"{name}_s"] = time.perf_counter() - self._start
        self.figures[f"{name}_peak_mb"] = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        self._start = time.perf_counter()


def write_casting(folder: Path, refinement: float) -> Path:
    """Write the files of the solid and the arm; returns the YAML."""
    n_x, n_y, n_z = (max(round(n * refinement), 2) for n in CELLS)
    cells = np.zeros((n_x, n_y, n_z), dtype=bool)
    cells[:, :, : max(n_z // 4, 1)] = cells[: max(n_x // 4, 1)] = True
    solid = make_solid(cells, np.full(3, EDGE / refinement), ALUMINIUM)
    top, end = solid.x.max(axis=0)[[2, 0]] - 1e-6
    sets = {"root": solid.select(lambda x: x[2] > top), "flange": solid.select(lambda x: x[0] > end)}
    write_solid(solid, folder, sets)
    path = folder / "arm.yaml"
    path.write_text(ARM, encoding="utf-8")
    return path


def swing(plant: Plant, seconds: float) -> None:
    """Drive the arm by a torque that reverses halfway."""
    steps = round(seconds / plant.dt)
    for k in range(steps):
        plant.drive(np.array([TORQUE if k < steps / 2 else -TORQUE]))


def main(refinement: float = 1.0, modes: int = 350, seconds: float = 3.0) -> dict[str, float]:
    """Measure; returns seconds and megabytes per stage, and what came out."""
    with tempfile.TemporaryDirectory() as folder:
        path = write_casting(Path(folder), refinement)
        stages = Stages()
        config = load_config(path)
        body = config.bodies["casting"]
        assert isinstance(body, ImportedBody)
        model = load_model(body)
        stages.end("read")
        value, _ = lowest_modes(model.M, model.K, modes, SHIFT)
        stages.end("modes")
        checks = check_model(model)
        stages.end("check")
        element = reduce_body(body, {"root", "flange"})
        stages.end("reduce")
        plant = Plant(config, 1.0 / config.rate_hz)  # reads and reduces once more, derives and compiles
        stages.end("build")
        swing(plant, seconds)
        stages.end("swing")
    return {
        "n_dof": checks.n_dof,
        "problems": len(checks.problems),
        "first_elastic_hz": float(checks.elastic_hz[0]),
        "highest_of_modes_hz": float(np.sqrt(value[-1]) / (2 * np.pi)),
        "superelement_highest_hz": float(element.omega[-1] / (2 * np.pi)),
        "substeps_per_period": plant.substeps,
        "final_angle_deg": float(np.degrees(plant.theta[0])),
        "simulated_s_per_s": seconds / stages.figures["swing_s"],
        **stages.figures,
    }


if __name__ == "__main__":
    for name, figure in main().items():
        print(f"{name:28} {figure:12.3f}")
