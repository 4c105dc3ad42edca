"""Seed 001, a mode drawn on the mechanism: lines of legs and platform as they stand and as they swing."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.reproduce.seed_001_machine import Machine
from flexarm_model.description import RigidBody

Array = NDArray[np.float64]

LEGS = (1, 2, 3)
POINTS = 21  # along a leg
SWING = 0.03  # largest displacement drawn [m]


@dataclass(frozen=True)
class Lines:
    """Polylines of the mechanism in the world [m], (k, 3) each: as it stands, and displaced by a mode."""

    still: list[Array]
    moved: list[Array]


def mode_lines(machine: Machine, mode: int) -> Lines:
    """Return the mechanism at home, undeformed and in a mode.

    The platform moves as a rigid body; a leg follows its two hinges and bends by a half sine, whose size
    is what the served mode says of the middle of the leg.
    """
    platform = machine.config.bodies["platform"]
    assert isinstance(platform, RigidBody)
    T_world_tool = machine.tree.tip_pose(machine.model.q0)
    tool = platform.nodes["tool"]
    centre = T_world_tool[:3, 3] - tool
    hinges = [platform.nodes[f"leg_{i}"] for i in LEGS]
    corners = [*hinges, hinges[0], np.zeros(3), tool]
    still, moved = [centre + np.array(corners)], [_shift(machine, mode, np.array(corners) - tool)]
    for i, hinge in zip(LEGS, hinges, strict=True):
        placement = next(joint.placement for joint in machine.config.joints if joint.name == f"base_{i}")
        share = np.linspace(0.0, 1.0, POINTS)[:, None]
        base = placement[:3, 3]
        still.append(base + share * (centre + hinge - base))
        bent = placement[:3, :3] @ _middle(machine, mode, f"leg_{i}")
        moved.append(share * _shift(machine, mode, hinge[None] - tool) + np.sin(np.pi * share) * bent)
    scale = SWING / max(float(np.linalg.norm(line, axis=1).max()) for line in moved)
    return Lines(still, [line + scale * motion for line, motion in zip(still, moved, strict=True)])


def _shift(machine: Machine, mode: int, r: Array) -> Array:
    """Return how points of the platform, at ``r`` from the tool (k, 3), move in a mode, (k, 3)."""
    outputs = machine.model.outputs
    motion = outputs.C_pos[outputs.rows("tip"), machine.model.n_theta + mode]
    return np.asarray(motion[:3] + np.cross(motion[3:], r))


def _middle(machine: Machine, mode: int, leg: str) -> Array:
    """Return how the middle of a leg leaves the line between its hinges, in the leg's axes, (3,)."""
    index = machine.tree.elastic_coordinates(leg)
    eta = machine.model.Phi[index.start : index.stop, machine.model.n_theta + mode]
    middle = machine.tree.bodies[leg].nodes["gauge"].Phi @ eta
    return np.array([0.0, middle[1], middle[2]])
