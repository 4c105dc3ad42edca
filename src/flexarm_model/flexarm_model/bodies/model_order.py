"""The same manipulator with bodies modelled more finely or more coarsely: for comparisons of models.

Full finite elements are a Craig-Bampton reduction that keeps every mode (``f_max`` infinite).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from flexarm_model.bodies.beam_superelement import count_modes
from flexarm_model.bodies.body_reduction import reduce_to_first_order
from flexarm_model.bodies.few_modes import joined_nodes
from flexarm_model.manipulator.body_spec import Beam, Body, RigidBody
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.manipulator.imported_body import ImportedBody, SuperelementBody

FULL = math.inf  # Hz


def with_static_modes(config: ManipulatorConfig) -> ManipulatorConfig:
    """Return the manipulator with every beam reduced to its interfaces (Guyan)."""
    return _with_reduction(config, "guyan", 0.0)


def with_modes_below(config: ManipulatorConfig, f_max: float) -> ManipulatorConfig:
    """Return the manipulator with every beam's fixed-interface modes up to ``f_max`` [Hz] (Craig-Bampton).

    Args:
        config: The manipulator.
        f_max: Highest frequency; ``FULL`` keeps all displacements of the finite elements.
    """
    return _with_reduction(config, "craig_bampton", f_max)


def with_more_modes(config: ManipulatorConfig, extra: int) -> ManipulatorConfig:
    """Return the manipulator with ``extra`` more modes of every body that says how many to keep.

    A body of few elements keeps all it has. ``bodies_without_more`` names those that stay as they are.
    """

    def richer(body: Body) -> Body:
        """Return the body with more modes."""
        if isinstance(body, ImportedBody) and _says_how_many(body):
            # how many there are is known when its matrices are read
            return replace(body, reduction=replace(body.reduction, spare=extra))
        if isinstance(body, Beam) and _says_how_many(body):
            kept = body.reduction.modes
            modes = max(kept, min(kept + extra, count_modes(body, joined_nodes(config, body.name))))
            return replace(body, reduction=replace(body.reduction, modes=modes))
        return body

    return replace(config, bodies={name: richer(body) for name, body in config.bodies.items()})


def bodies_without_more(config: ManipulatorConfig) -> list[str]:
    """Return the flexible bodies whose modes are all given: by a frequency, static ones or a superelement."""
    return [
        name
        for name, body in config.bodies.items()
        if isinstance(body, SuperelementBody)
        or (isinstance(body, Beam | ImportedBody) and not _says_how_many(body))
    ]


def with_elements(config: ManipulatorConfig, elements: int) -> ManipulatorConfig:
    """Return the manipulator with that many elements in every flexible piece."""

    def finer(body: Body) -> Body:
        """Return the body with more elements."""
        if not isinstance(body, Beam):
            return body
        return replace(
            body, pieces=tuple(p if p.rigid else replace(p, elements=elements) for p in body.pieces)
        )

    return replace(config, bodies={name: finer(body) for name, body in config.bodies.items()})


def with_rigid_beams(config: ManipulatorConfig) -> ManipulatorConfig:
    """Return the manipulator whose beams are rigid bodies of the same mass, and whose gauges are gone."""

    def rigid(body: Body) -> Body:
        """Return the body without what bends."""
        return _rigid_beam(body) if isinstance(body, Beam) else body

    sensors = tuple(sensor for sensor in config.sensors if sensor.kind != "strain_gauge")
    return replace(
        config, bodies={name: rigid(body) for name, body in config.bodies.items()}, sensors=sensors
    )


def _says_how_many(body: Beam | ImportedBody) -> bool:
    return bool(body.reduction.modes) and body.reduction.method == "craig_bampton"


def _with_reduction(config: ManipulatorConfig, method: str, f_max: float) -> ManipulatorConfig:
    def reduced(body: Body) -> Body:
        """Return the body reduced by the method."""
        if not isinstance(body, Beam):
            return body
        return replace(body, reduction=replace(body.reduction, method=method, modes=0, f_max=f_max))

    return replace(config, bodies={name: reduced(body) for name, body in config.bodies.items()})


def _rigid_beam(beam: Beam) -> RigidBody:
    still = replace(
        beam, reduction=replace(beam.reduction, method="guyan", modes=0, frame="clamped", retain=())
    )
    body = reduce_to_first_order(still, ())
    com = body.s[0] / body.mass
    second = body.P[0, 0] - body.mass * np.outer(com, com)
    inertia = np.trace(second) * np.eye(3) - second
    return RigidBody(beam.name, body.mass, com, inertia, {name: node.r for name, node in body.nodes.items()})
