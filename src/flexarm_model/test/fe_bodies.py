"""Small solids for the tests of imported bodies, written to files as another program would."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from flexarm_model.fe_import.fe_model import FeModel
from flexarm_model.fe_import.hexahedra import Material, Solid, make_solid, write_solid
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.imported_body import ImportedBody
from flexarm_model.reading.config import load_config

Array = NDArray[np.float64]

ALUMINIUM = Material(E=70e9, nu=0.3, density=2700.0)
LENGTH, WIDTH, HEIGHT = 0.4, 0.020, 0.016  # of the slender block [m]


def block(n_x: int = 10, lumped: bool = False, nu: float = ALUMINIUM.nu) -> Solid:
    """Return a slender block along x, n_x by 2 by 2 bricks, its root face centred at the origin."""
    size = np.array([LENGTH / n_x, WIDTH / 2, HEIGHT / 2])
    solid = make_solid(np.ones((n_x, 2, 2), dtype=bool), size, replace(ALUMINIUM, nu=nu), lumped=lumped)
    return Solid(solid.x - [0, WIDTH / 2, HEIGHT / 2], solid.M, solid.K)


def bracket(lumped: bool = False) -> Solid:
    """Return an angle without symmetry: no mode is uncoupled by accident."""
    cells = np.zeros((5, 2, 4), dtype=bool)
    cells[:, :, 0] = cells[0, :, :] = cells[3, 0, 1] = True
    return make_solid(cells, np.array([0.03, 0.025, 0.02]), ALUMINIUM, lumped=lumped)


def model(solid: Solid) -> FeModel:
    """Return a solid as the import sees it."""
    return FeModel("solid", solid.x, solid.M, solid.K, None)


def ends(solid: Solid) -> dict[str, NDArray[np.intp]]:
    """Return the labels of the nodes at the lowest and at the highest x."""
    low, high = solid.x[:, 0].min(), solid.x[:, 0].max()
    return {
        "root": solid.select(lambda x: x[0] < low + 1e-9),
        "end": solid.select(lambda x: x[0] > high - 1e-9),
    }


def description(suffix: str = ".mtx", **body: Any) -> dict[str, Any]:
    """Return the YAML of an arm: two axes, the solid, a payload on its end. ``body`` changes the solid."""
    solid = {
        "type": "imported",
        "mass": {"file": f"mass{suffix}"},
        "stiffness": {"file": f"stiffness{suffix}"},
        "nodes": "nodes.csv",
        "units": {"length": "m", "mass": "kg"},
        "interfaces": {
            "root": {"set": "root.txt", "kind": "rigid"},
            "end": {"set": "end.txt", "kind": "averaging"},
        },
        "damping_ratio": 0,
        "reduction": {"method": "craig_bampton", "modes": 10},
    }
    inertia = [f"{value} kg m^2" for value in (0.0002, 0.0003, 0.0004, 0.00001, 0.00002, 0.00003)]
    payload = {"type": "rigid", "mass": "200 g", "com": ["10 mm", "5 mm", "3 mm"], "inertia": inertia}
    return {
        "format": "flexarm/1",
        "name": "solid_arm",
        "source": "made up for the tests",
        "gravity": ["0 m/s^2", "0 m/s^2", "-9.81 m/s^2"],
        "bodies": {"solid": {**solid, **body}, "payload": payload},
        "joints": {
            "base": {
                "parent": "world",
                "child": "solid.root",
                "orientation": ["10 deg", "20 deg", "0 deg"],
                "axes": {"ry": {"actuated": True}, "rz": {"actuated": True}},
            },
            "flange": {
                "parent": "solid.end",
                "child": "payload.root",
                "orientation": ["0 deg", "0 deg", "40 deg"],
            },
        },
        "tip": "payload.root",
        "served": {"modes": 4, "home": ["0 deg", "0 deg"], "rate": "200 Hz"},
    }


def write_arm(folder: Path, solid: Solid, suffix: str = ".mtx", **body: Any) -> Path:
    """Write the files of an arm with a solid; returns the YAML."""
    write_solid(solid, folder, ends(solid), suffix)
    path = folder / "arm.yaml"
    path.write_text(yaml.safe_dump(description(suffix, **body), sort_keys=False), encoding="utf-8")
    return path


def load_arm(folder: Path, solid: Solid, suffix: str = ".mtx", **body: Any) -> ManipulatorConfig:
    """Write and load an arm with a solid."""
    return load_config(write_arm(folder, solid, suffix, **body))


def load_body(folder: Path, solid: Solid, suffix: str = ".mtx", **body: Any) -> ImportedBody:
    """Write and load a solid."""
    loaded = load_arm(folder, solid, suffix, **body).bodies["solid"]
    assert isinstance(loaded, ImportedBody)
    return loaded
