"""What the arm of ``flexarm sim`` may be instead of what its description says, and where it can not be."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np

from flexarm_bringup.sim.perturb import PlantSettings, perturb
from flexarm_bringup.sim.rig import RigSettings
from flexarm_model.manipulator.body_spec import Body, RigidBody
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
    if bodies := _without_further_modes(config):
        told.append(f"the rig has no more modes than are described of: {', '.join(bodies)}")
    return told


def _without_further_modes(config: ManipulatorConfig) -> list[str]:
    fewer, more = (perturb(config, replace(PlantSettings(), extra_modes=k)).bodies for k in (0, 1))
    bending = [name for name, body in config.bodies.items() if not isinstance(body, RigidBody)]
    return [name for name in bending if _written(fewer[name]) == _written(more[name])]


def _written(item: ManipulatorConfig | Body) -> bytes:
    return pickle.dumps(item)  # exact, and names every value
