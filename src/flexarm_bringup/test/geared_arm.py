"""A motor, a gear with play and a lever about an upright axis: all of it can be written in closed form."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from flexarm_bringup.sim.backlash import Gaps, gaps_of
from flexarm_bringup.sim.explicit_steps import ExplicitSteps
from flexarm_bringup.sim.implicit_steps import ImplicitSteps
from flexarm_bringup.sim.plant import Steps
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]

ROTOR, LEVER = 0.5, 0.2  # kg m^2
STIFFNESS = 500.0  # N m/rad
PLAY = 2e-3  # rad
OMEGA = float(np.sqrt(STIFFNESS * (1 / ROTOR + 1 / LEVER)))  # of the engaged gear, 59 rad/s
MASS = np.array([[ROTOR + LEVER, LEVER], [LEVER, LEVER]])  # of the motor's angle and the gear's
PERIOD = 2e-3  # s
INTEGRATORS: dict[str, Any] = {"explicit": ExplicitSteps, "implicit": ImplicitSteps}

ARM = f"""
format: flexarm/1
name: geared
source: made up for the tests
gravity: [0 m/s^2, 0 m/s^2, 0 m/s^2]
bodies:
  rotor: {{type: rigid, mass: 0 kg}}
  lever:
    type: rigid
    mass: 1 kg
    inertia: [{LEVER} kg m^2, {LEVER} kg m^2, {LEVER} kg m^2, 0 kg m^2, 0 kg m^2, 0 kg m^2]
joints:
  motor:
    parent: world
    child: rotor.root
    axes:
      rz: {{actuated: true, rotor_inertia: {ROTOR} kg m^2, effort: 20 N m, effort_rate: 2000 N m/s,
           velocity: 5 rad/s, lower: -170 deg, upper: 170 deg}}
  gear:
    parent: rotor.root
    child: lever.root
    axes: {{rz: {{stiffness: {STIFFNESS} N m/rad, damping: 0 N m s/rad, backlash: {PLAY} rad}}}}
sensors:
  encoder: {{kind: encoder, axis: motor.rz, sigma: 20 urad}}
tip: lever.root
served: {{modes: 1, home: [0 deg], rate: 500 Hz}}
"""


def geared_arm(folder: Path, lever: dict[str, Any] | None = None, **gear: str) -> ManipulatorConfig:
    """Return the arm with other values of its gear's axis and of its lever; ``gravity`` of the arm, too."""
    content = yaml.safe_load(ARM)
    gravity = gear.pop("gravity", "0 m/s^2")
    content["gravity"][1] = gravity
    content["joints"]["gear"]["axes"]["rz"].update(gear)
    content["bodies"]["lever"].update(lever or {})
    path = folder / "geared.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return load_config(path)


class GearedArm:
    """State of the arm under one of the integrators.

    Attributes:
        q, v: Angles of motor and gear [rad], and their rates, (2,) each.
        gaps: Its gear.
    """

    def __init__(self, config: ManipulatorConfig, integrator: str, substeps: int, v: Array) -> None:
        """Start in the middle of the gap with these rates."""
        tree = ReducedTree(config)
        self.gaps: Gaps = gaps_of(tree)
        self._steps: Steps = INTEGRATORS[integrator](tree, PERIOD, substeps, 0.0)
        self.q, self.v = np.zeros(2), np.array(v)

    def drive(self, torque: float = 0.0) -> None:
        """Advance a period under a torque of the motor [N m]."""
        self.q, self.v, _ = self._steps.drive(self.q, self.v, np.array([torque]))

    def lead(self, acceleration: float) -> None:
        """Advance a period with the motor accelerated as prescribed [rad/s^2]."""
        self.q, self.v, _ = self._steps.servo(self.q, self.v, np.array([acceleration]))

    @property
    def momentum(self) -> float:
        """About the axis [kg m^2/s]."""
        return float(MASS[0] @ self.v)

    @property
    def energy(self) -> float:
        """Kinetic energy and that of the teeth [J]."""
        depth = max(0.0, abs(self.q[1]) - PLAY / 2)
        return float(self.v @ MASS @ self.v + STIFFNESS * depth**2) / 2
