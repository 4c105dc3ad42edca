"""What the arm of ``flexarm sim`` may be instead of what its description says, and where it can not be."""

from __future__ import annotations

import pickle

import numpy as np

from flexarm_bringup.sim.perturb import perturb
from flexarm_bringup.sim.rig import RigSettings
from flexarm_model.bodies.model_order import bodies_without_more
from flexarm_model.manipulator.description import ManipulatorConfig

NOMINAL = "as described"
CONDITIONS = {
    NOMINAL: RigSettings(),
    "mass +20 %": RigSettings(body_mass_scale=1.2),
    "stiffness -20 %": RigSettings(frequency_scale=float(np.sqrt(0.8))),
    "frequency -10 %": RigSettings(frequency_scale=0.9),
    "frequency +10 %": RigSettings(frequency_scale=1.1),
}


def idle_conditions(config: ManipulatorConfig) -> list[str]:
    """Return the conditions under which the arm is the one described, so that a run of them says nothing."""
    described = _written(perturb(config, CONDITIONS[NOMINAL].plant))
    others = {name: rig.plant for name, rig in CONDITIONS.items() if name != NOMINAL}
    return [name for name, plant in others.items() if _written(perturb(config, plant)) == described]


def describe_idle(config: ManipulatorConfig) -> list[str]:
    """Return, in words, what the rig cannot change of the arm; nothing where it can change all."""
    idle, told = idle_conditions(config), []
    if idle:
        told.append(f"not simulated, for nothing of the arm would change: {', '.join(idle)}")
    if bodies := bodies_without_more(config):
        told.append(f"the rig has no more modes than are described of: {', '.join(bodies)}")
    return told


def _written(config: ManipulatorConfig) -> bytes:
    return pickle.dumps(config)  # exact, and names every value
