"""How the real arm differs from its description: a pure function of the description.

Stiffness scales wherever it is elastic: beams, imported bodies, superelements, springs of axes; their damping
likewise, not the viscous friction of axes that no spring holds. Masses scale in all bodies. A damping matrix
that a file gives scales with the stiffness, too, as viscous damping of a material does. What a superelement
does not say stays as it is: which of its mass is a point mass, and modes beyond those of its file.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from flexarm_bringup.sim.backlash import find_gears
from flexarm_model.bodies.model_order import with_more_modes
from flexarm_model.manipulator.body_spec import Beam, Body, RigidBody
from flexarm_model.manipulator.description import Joint, ManipulatorConfig
from flexarm_model.manipulator.imported_body import ImportedBody, SuperelementBody
from flexarm_model.settings.strict_yaml import ConfigError

_Given = TypeVar("_Given", ImportedBody, SuperelementBody)


@dataclass(frozen=True)
class PlantSettings:
    """How the real arm differs from its description.

    Attributes:
        frequency_scale: Real over described natural frequencies, by the stiffness of everything elastic [1].
        mass_scale: Real over described point masses of beams [1].
        extra_modes: Elastic coordinates per flexible body beyond those described, as far as it has them.
        friction: Coulomb friction of the actuated axes [N m or N], one value for all.
        body_mass_scale: Real over described masses of all bodies, their point masses too [1].
        damping_scale: Real over described damping of bodies that bend and of springs of axes [1].
        rotor_scale: Real over described rotor inertias [1].
        backlash: Total play of every gear beyond that described [rad or m].
    """

    frequency_scale: float = 1.0
    mass_scale: float = 1.0
    extra_modes: int = 3
    friction: float = 0.0
    body_mass_scale: float = 1.0
    damping_scale: float = 1.0
    rotor_scale: float = 1.0
    backlash: float = 0.0


def perturb(config: ManipulatorConfig, settings: PlantSettings) -> ManipulatorConfig:
    """Return the description of the arm as it really is.

    Raises:
        ConfigError: Play is asked for and the arm has no gear.
    """
    changed = {name: _CHANGES[type(body)](body, settings) for name, body in config.bodies.items()}
    gears = find_gears(config) if settings.backlash else set()
    if settings.backlash and not gears:
        wanted = "no spring at the node that a motor moves, along its axis"
        raise ConfigError(f"'{config.name}': backlash: {settings.backlash:g}: it has no gear ({wanted})")
    joints, closures = (
        tuple(_change_joint(joint, settings, gears) for joint in group)
        for group in (config.joints, config.closures)
    )
    changed_arm = replace(config, bodies=changed, joints=joints, closures=closures)
    return with_more_modes(changed_arm, settings.extra_modes)


def _change_joint(joint: Joint, settings: PlantSettings, gears: set[str]) -> Joint:
    stiffness, damping = settings.frequency_scale**2, settings.damping_scale
    axes = tuple(
        replace(
            axis,
            stiffness=axis.stiffness * stiffness,
            damping=axis.damping * (damping if axis.stiffness else 1.0),
            damping_ratio=axis.damping_ratio * damping,
            rotor_inertia=axis.rotor_inertia * settings.rotor_scale,
            backlash=axis.backlash + settings.backlash * (f"{joint.name}.{axis.name}" in gears),
        )
        for axis in joint.axes
    )
    return replace(joint, axes=axes)


def _change_rigid(body: RigidBody, settings: PlantSettings) -> RigidBody:
    scale = settings.body_mass_scale
    return replace(body, mass=body.mass * scale, inertia=body.inertia * scale)


def _change_beam(beam: Beam, settings: PlantSettings) -> Beam:
    stiffness, heavier = settings.frequency_scale**2, settings.body_mass_scale
    pieces = tuple(
        replace(
            piece,
            E=piece.E * stiffness,
            G=piece.G * stiffness,
            axial_rigidity=None if piece.axial_rigidity is None else piece.axial_rigidity * stiffness,
            density=piece.density * heavier,
        )
        for piece in beam.pieces
    )
    mass_scale = settings.mass_scale * heavier
    masses = tuple(
        replace(point, mass=point.mass * mass_scale, inertia=point.inertia * mass_scale)
        for point in beam.point_masses
    )
    return replace(
        beam,
        pieces=pieces,
        point_masses=masses,
        damping_ratio=beam.damping_ratio * settings.damping_scale,
        damping_time=beam.damping_time * settings.damping_scale,
        damping_rate=beam.damping_rate * settings.damping_scale,
    )


def _change_imported(body: ImportedBody, settings: PlantSettings) -> ImportedBody:
    return replace(
        _change_matrices(body, settings),
        damping_ratio=body.damping_ratio * settings.damping_scale,
        damping_time=body.damping_time * settings.damping_scale,
        damping_rate=body.damping_rate * settings.damping_scale,
    )


def _change_matrices(body: _Given, settings: PlantSettings) -> _Given:
    return replace(
        body,
        stiffness_scale=body.stiffness_scale * settings.frequency_scale**2,
        mass_scale=body.mass_scale * settings.body_mass_scale,
        damping_scale=body.damping_scale * settings.damping_scale,
    )


_CHANGES: dict[type, Callable[[Any, PlantSettings], Body]] = {
    RigidBody: _change_rigid,
    Beam: _change_beam,
    ImportedBody: _change_imported,
    SuperelementBody: _change_matrices,
}
