"""A rigid four-bar linkage in a plane, with its closed form."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config

CRANK, COUPLER, ROCKER, GROUND = 0.1, 0.3, 0.25, 0.3  # lengths [m]

_BAR = """\
  {name}: {{type: rigid, mass: 1 kg, inertia: [1e-4 kg m^2, 1e-3 kg m^2, 1e-3 kg m^2, {off}],
    nodes: {{end: [{length} m, 0 mm, 0 mm]}}}}
"""
_REST = """\
joints:
  motor: {{parent: world, child: crank.root, axes: {{rz: {{actuated: true, rotor_inertia: 0.01 kg m^2}}}}}}
  pin: {{parent: crank.end, child: coupler.root, axes: {{rz: {{guess: -27 deg}}}}}}
  knee: {{parent: coupler.end, child: rocker.root, axes: {{rz: {{guess: -123 deg}}}}}}
  ground: {{parent: world, child: rocker.end, position: [{ground} m, 0 mm, 0 mm], axes: {{{axis}}}}}
sensors: {{encoder: {{kind: encoder, axis: motor.rz, sigma: 1 mrad}}}}
tip: coupler.end
served: {{modes: 0, home: [60 deg], rate: 100 Hz}}
"""


def four_bar(folder: Path, closing: str = "rz: {stiffness: 2 N m/rad, guess: -90 deg}") -> ManipulatorConfig:
    """Return the linkage; ``closing`` are the axes of the joint that closes its loop, as YAML."""
    lengths = {"crank": CRANK, "coupler": COUPLER, "rocker": ROCKER}
    off = ", ".join(["0 kg m^2"] * 3)
    bars = "".join(_BAR.format(name=name, length=length, off=off) for name, length in lengths.items())
    head = "format: flexarm/1\nname: four_bar\nsource: test\ngravity: [0 m/s^2, 0 m/s^2, 0 m/s^2]\nbodies:\n"
    path = folder / "four_bar.yaml"
    path.write_text(head + bars + _REST.format(ground=GROUND, axis=closing), encoding="utf-8")
    return load_config(path)


def rocker_angle(crank: float) -> float:
    """Return the rocker's direction, from knee to ground, with the knee above [rad], in (-pi, pi]."""
    pin = CRANK * np.array([np.cos(crank), np.sin(crank)])
    ground = np.array([GROUND, 0.0])
    span = np.linalg.norm(ground - pin)
    along = (COUPLER**2 - ROCKER**2 + span**2) / (2 * span)
    e = (ground - pin) / span
    knee = pin + along * e + np.sqrt(COUPLER**2 - along**2) * np.array([-e[1], e[0]])
    return float(np.arctan2(*(ground - knee)[::-1]))
