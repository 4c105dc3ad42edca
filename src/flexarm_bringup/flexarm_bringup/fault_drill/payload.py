"""A payload that is taken up on the way: all masses of the simulated arm grow at once, nothing jumps.

The elastic coordinates of a body are normalised by its mass: the same deflection of a body that is ``s``
times as heavy has ``sqrt(s)`` times the coordinates, and so has its velocity.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.closed_loop import Observer
from flexarm_bringup.sim.hardware import Hardware
from flexarm_bringup.sim.plant import Plant
from flexarm_estimator.estimate import Estimate

Array = NDArray[np.float64]


def take_over(heavier: Plant, plant: Plant) -> None:
    """Put ``heavier`` where ``plant`` is, with its velocity; they differ in the masses of bodies only."""
    scale = np.ones(plant.tree.n_q)
    ratio = heavier.settings.body_mass_scale / plant.settings.body_mass_scale
    scale[len(plant.tree.axis_names) :] = np.sqrt(ratio)
    heavier.q, heavier.v, heavier.a = scale * plant.q, scale * plant.v, scale * plant.a


def attaching(heavier: Plant, at: float, observe: Observer) -> Observer:
    """Return what observes a loop, and from ``at`` [s] on has ``heavier`` in the place of its plant."""

    def look(hardware: Hardware, estimate: Estimate) -> Mapping[str, Array]:
        rig = hardware.rig
        if rig.plant is not heavier and hardware.t >= at:
            take_over(heavier, rig.plant)
            rig.plant = heavier
        return observe(hardware, estimate)

    return look
