"""One beam on a turning hub, with parts of its description changed: for tests of what is refused and why."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

ARM = """
format: flexarm/1
name: small
source: made up for the tests
gravity: [0 m/s^2, 0 m/s^2, 0 m/s^2]
bodies:
  hub: {type: rigid, mass: 1 kg, inertia: [1 kg m^2, 1 kg m^2, 1 kg m^2, 0 kg m^2, 0 kg m^2, 0 kg m^2]}
  strip:
    type: beam
    pieces:
      - {length: 500 mm, section: {shape: rectangle, along_y: 4 mm, along_z: 20 mm}, youngs_modulus: 200 GPa,
         density: 7800 kg/m^3, elements: 8}
    deformation: [bend_y]
    damping_ratio: 0.01
    nodes: {gauge: 10 mm, tip: 500 mm}
    reduction: {method: craig_bampton, modes: 3, frame: clamped}
joints:
  base:
    parent: world
    child: hub.root
    axes:
      rz: {actuated: true, rotor_inertia: 0.1 kg m^2, effort: 5 N m, effort_rate: 500 N m/s,
           velocity: 5 rad/s, lower: -170 deg, upper: 170 deg}
  clamp: {parent: hub.root, child: strip.root}
sensors:
  encoder: {kind: encoder, axis: base.rz, sigma: 20 urad}
  gauge: {kind: strain_gauge, node: strip.gauge, offset: [2 mm, 0 mm], sigma: 1 ustrain}
tip: strip.tip
served: {modes: 2, home: [0 deg], rate: 200 Hz}
"""


def small_arm(folder: Path, **changes: Any) -> Path:
    """Write the arm; a key such as ``served__modes`` is a path, a value of None takes a part away."""
    content: Any = yaml.safe_load(ARM)
    for key, value in changes.items():
        *parents, last = key.split("__")
        place = content
        for parent in parents:
            place = place[parent]
        if value is None:
            del place[last]
        else:
            place[last] = value
    path = folder / "small.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return path
