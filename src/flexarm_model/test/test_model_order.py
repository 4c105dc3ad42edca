"""Bodies with more modes: as many as were asked for, and no more than their elements have."""

from __future__ import annotations

from dataclasses import replace

import pytest
from arms import arm

from flexarm_model.bodies.model_order import with_more_modes
from flexarm_model.manipulator.body_spec import Beam
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.tree.reduced_tree import ReducedTree


def coarse(elements: int, modes: int) -> ManipulatorConfig:
    """Return the single link with few elements."""
    config = arm("single_link")
    strip = config.bodies["strip"]
    assert isinstance(strip, Beam)
    pieces = tuple(replace(piece, elements=elements) for piece in strip.pieces)
    reduction = replace(strip.reduction, modes=modes)
    return replace(
        config, bodies={**config.bodies, "strip": replace(strip, pieces=pieces, reduction=reduction)}
    )


@pytest.mark.parametrize(("elements", "modes", "kept"), [(1, 1, 2), (1, 2, 2), (2, 2, 4), (8, 2, 5)])
def test_a_beam_keeps_no_more_modes_than_it_has(elements: int, modes: int, kept: int) -> None:
    """The rig adds three modes to what is served: an arm of one element could not be simulated."""
    tree = ReducedTree(with_more_modes(coarse(elements, modes), 3), use_compiler=False)
    assert tree.bodies["strip"].n == kept


def test_what_was_asked_for_beyond_what_there_is_is_still_refused() -> None:
    with pytest.raises(ValueError, match="7 modes asked for"):
        ReducedTree(with_more_modes(coarse(1, 7), 3), use_compiler=False)
