"""The rig's arm differs from its description also where bodies are imported."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flexarm_bringup.sim.perturb import PlantSettings, perturb
from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.fe_import.hexahedra import Material, make_solid, write_solid
from flexarm_model.manipulator.imported_body import ImportedBody
from flexarm_model.reading.config import load_config

ARM = """
format: flexarm/1
name: solid
source: made up for the tests
gravity: [0 m/s^2, 0 m/s^2, 0 m/s^2]
bodies:
  solid:
    type: imported
    mass: {file: mass.mtx}
    stiffness: {file: stiffness.mtx}
    nodes: nodes.csv
    units: {length: m, mass: kg}
    interfaces: {root: {set: root.txt, kind: rigid}}
    damping_ratio: 1 %
    reduction: {method: craig_bampton, modes: 3}
joints:
  base: {parent: world, child: solid.root, axes: {rz: {actuated: true}}}
tip: solid.root
served: {modes: 2, home: [0 deg], rate: 200 Hz}
"""


def test_an_imported_body_is_faster_and_has_more_modes_on_the_rig(tmp_path: Path) -> None:
    solid = make_solid(
        np.ones((4, 1, 1), dtype=bool), np.array([0.05, 0.01, 0.02]), Material(70e9, 0.3, 2700.0)
    )
    write_solid(solid, tmp_path, {"root": solid.select(lambda x: x[0] < 1e-9)})
    (tmp_path / "arm.yaml").write_text(ARM, encoding="utf-8")
    config = load_config(tmp_path / "arm.yaml")
    real = perturb(config, PlantSettings(frequency_scale=1.1, extra_modes=2)).bodies["solid"]
    described, found = (reduce_body(body, {"root"}) for body in (config.bodies["solid"], real))
    assert found.n == described.n + 2
    assert found.omega[:3] == pytest.approx(1.1 * described.omega, rel=1e-9)
    assert isinstance(real, ImportedBody)
    by_frequency = replace(real, reduction=replace(real.reduction, modes=0, f_max=5000.0))
    same = perturb(replace(config, bodies={"solid": by_frequency}), PlantSettings(extra_modes=2)).bodies[
        "solid"
    ]
    assert isinstance(same, ImportedBody) and same.reduction == by_frequency.reduction
