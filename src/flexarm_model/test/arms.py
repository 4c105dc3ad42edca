"""The arms of the tests: described once, built once per test session."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_model.manipulator.body_spec import Beam, BeamPiece, PointMass, Reduction
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.reading.config import load_config
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]

FOLDER = Path(__file__).parent / "arms"
SINGLE_LINK = Path(__file__).parents[2] / "flexarm_bringup/config/manipulators/single_link.yaml"

WIDTH, HEIGHT, E, DENSITY = 0.004, 0.010, 70e9, 2700.0  # a square-edged bar that bends two ways
BAR = BeamPiece(
    length=0.5,
    area=WIDTH * HEIGHT,
    I_y=WIDTH * HEIGHT**3 / 12,
    I_z=HEIGHT * WIDTH**3 / 12,
    torsion_constant=2.1e-10,
    E=E,
    G=27e9,
    density=DENSITY,
    elements=8,
)


@cache
def arm(name: str, preset: str = "") -> ManipulatorConfig:
    """Return the description of an arm; "single_link" is the one that flexarm ships."""
    return load_config(SINGLE_LINK if name == "single_link" else FOLDER / f"{name}.yaml", preset)


@cache
def tree(name: str, preset: str = "") -> ReducedTree:
    """Return the reduced tree of an arm, on the virtual machine."""
    return ReducedTree(arm(name, preset), use_compiler=False)


def bar(deformation: Iterable[str] = ("bend_y",), **changes: Any) -> Beam:
    """Return a beam of one piece with a node "end"; ``changes`` go to the beam or to its piece."""
    own = {key: changes.pop(key) for key in list(changes) if key in Beam.__dataclass_fields__}
    piece = replace(BAR, **changes)
    beam = Beam("bar", (piece,), (), tuple(deformation), 0.0, {"root": 0.0, "end": piece.length},
                Reduction("craig_bampton", 4, "clamped"))  # fmt: skip
    return replace(beam, **own)


def tip_mass(mass: float, at: float = BAR.length) -> tuple[PointMass, ...]:
    """Return one point mass."""
    return (PointMass("tip", at, mass),)


def with_modes(config: ManipulatorConfig, modes: int, elements: int = 0) -> ManipulatorConfig:
    """Return the arm with another number of modes, and perhaps elements, per beam."""

    def finer(body: Any) -> Any:
        if not isinstance(body, Beam):
            return body
        pieces = tuple(replace(piece, elements=elements or piece.elements) for piece in body.pieces)
        reduction = replace(body.reduction, method="craig_bampton", modes=modes)
        return replace(body, pieces=pieces, reduction=reduction)

    return replace(config, bodies={name: finer(body) for name, body in config.bodies.items()})


def scales(arm_tree: ReducedTree) -> Array:
    """Return how far each coordinate may go, (n_q,).

    A joint goes 1 rad (1 m), a mode 0.1 rad at its steepest node or, where it turns none, 1 mm.
    """
    scale = np.ones(arm_tree.n_q)
    for name, body in arm_tree.bodies.items():
        at = arm_tree.elastic_coordinates(name)
        turn = np.max([abs(node.Psi).max(axis=0, initial=0.0) for node in body.nodes.values()], axis=0)
        shift = max((abs(node.Phi).max(initial=0.0) for node in body.nodes.values()), default=0.0)
        still = np.full(body.n, 1e-3 / shift if shift else 1.0)
        scale[at.start : at.stop] = np.divide(0.1, turn, out=still, where=turn > 1e-9 * shift)
    return scale


def random_states(arm_tree: ReducedTree, count: int, seed: int = 1) -> Array:
    """Return positions, velocities and accelerations within the coordinates' scales, (count, 3, n_q)."""
    x = np.random.default_rng(seed).uniform(-1.5, 1.5, (count, 3, arm_tree.n_q))
    return np.asarray(x * scales(arm_tree))
