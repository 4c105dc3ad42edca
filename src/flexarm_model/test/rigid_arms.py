"""Any arm with its beams made rigid, mass and shape kept."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from flexarm_model.manipulator.body_spec import Beam, RigidBody
from flexarm_model.manipulator.description import ManipulatorConfig


def rigid_version(config: ManipulatorConfig) -> ManipulatorConfig:
    """Return the arm with every beam a rigid body of the same mass properties, without sensors."""
    bodies = {
        name: rigid_beam(body) if isinstance(body, Beam) else body for name, body in config.bodies.items()
    }
    return replace(config, bodies=bodies, sensors=(), modes=0)


def rigid_beam(beam: Beam) -> RigidBody:
    """Return the beam as a rigid body: thin rods with the section's own inertia, and point masses."""
    parts: list[tuple[float, float, Any]] = [
        (p.mass, p.at, p.inertia * np.ones(3)) for p in beam.point_masses
    ]
    start = 0.0
    for piece in beam.pieces:
        if not piece.rigid:
            mass, per_area = piece.density * piece.area * piece.length, piece.density * piece.length
            turning = np.array([1.0, 1.0, 1.0]) if beam.rotary_inertia else np.array([1.0, 0.0, 0.0])
            section = per_area * turning * np.array([piece.I_y + piece.I_z, piece.I_y, piece.I_z])
            rod = mass * piece.length**2 / 12 * np.array([0.0, 1.0, 1.0])
            parts.append((mass, start + piece.length / 2, section + rod))
        start += piece.length
    total = sum(mass for mass, _, _ in parts)
    com = sum(mass * x for mass, x, _ in parts) / total
    J = sum(own + mass * (x - com) ** 2 * np.array([0.0, 1.0, 1.0]) for mass, x, own in parts)
    nodes = {name: np.array([x, 0.0, 0.0]) for name, x in beam.nodes.items()}
    return RigidBody(beam.name, total, np.array([com, 0.0, 0.0]), np.diag(J), nodes)
