"""A payload that is taken up on the way: all masses of the simulated arm grow at once, nothing jumps.

The elastic coordinates of a body are normalised by its mass: the same deflection of a body that is ``s``
times as heavy has ``sqrt(s)`` times the coordinates, with either sign, and so has its velocity. The factors
are read off the shapes at the nodes: ``Phi_old eta_old = Phi_new eta_new``, mode by mode.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.closed_loop import Observer
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.plant import Plant
from flexarm_estimator.estimate import Estimate
from flexarm_model.bodies.superelement import Superelement

Array = NDArray[np.float64]


def take_over(heavier: Plant, plant: Plant) -> None:
    """Put ``heavier`` where ``plant`` is, with its velocity; they differ in the masses of bodies only."""
    scale = np.ones(plant.tree.n_q)
    for name, body in plant.tree.bodies.items():
        old, new = _shapes(body), _shapes(heavier.tree.bodies[name])
        scale[list(plant.tree.elastic_coordinates(name))] = (old * new).sum(axis=0) / (new * new).sum(axis=0)
    heavier.q, heavier.v, heavier.a = scale * plant.q, scale * plant.v, scale * plant.a


def _shapes(body: Superelement) -> Array:
    """Return translations and rotations of all nodes by the body's coordinates, (k, n)."""
    return np.concatenate([part for node in body.nodes.values() for part in (node.Phi, node.Psi)])


def attaching(heavier: Plant, at: float, observe: Observer) -> Observer:
    """Return what observes a loop, and from ``at`` [s] on has ``heavier`` in the place of its plant."""

    def look(hardware: Hardware, estimate: Estimate) -> Mapping[str, Array]:
        """Change the plant when it is time; observe as before."""
        rig = hardware.rig
        if rig.plant is not heavier and hardware.t >= at:
            take_over(heavier, rig.plant)
            rig.plant = heavier
        return observe(hardware, estimate)

    return look
