"""A beam's mesh has no element that is too short: interfaces share a close node, short pieces are refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arms import BAR, bar, tip_mass

from flexarm_model.bodies.beam import BeamMesh
from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.bodies.short_elements import SHORTEST
from flexarm_model.bodies.superelement import Superelement
from flexarm_model.manipulator.body_spec import Beam, Reduction

KINDS = ("bend_y", "bend_z", "torsion", "stretch")
THIRD = BAR.length / 4  # where two elements meet


def with_node(at: float) -> Beam:
    """Return a bar with a mass at its end and an interface."""
    return bar(
        KINDS,
        point_masses=tip_mass(0.2),
        nodes={"root": 0.0, "third": at, "end": BAR.length},
        reduction=Reduction("craig_bampton", 18, "clamped"),
    )


def reduced(at: float) -> Superelement:
    return reduce_body(with_node(at), {"root", "third", "end"})


@pytest.mark.parametrize("share", [2e-8, 2e-6, 2e-5, 9e-5, 1.1e-4])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_interface_close_to_an_elements_end_leaves_the_frequencies(share: float, side: float) -> None:
    exact, moved = reduced(THIRD), reduced(THIRD + side * share * BAR.length)
    # static modes and some of the interior: where the interface stands changes their span a little
    assert moved.omega[:6] == pytest.approx(exact.omega[:6], rel=2e-4)


@pytest.mark.parametrize("share", [2e-6, 9e-5])
def test_its_own_place_still_counts(share: float) -> None:
    at = THIRD + share * BAR.length
    node, whole = reduced(at).nodes["third"], reduced(THIRD).nodes["third"]
    assert node.r[0] == pytest.approx(at, rel=1e-12)
    slope = whole.Psi[2, :6]  # of uy, where r_z = uy'
    assert node.Phi[1, :6] - whole.Phi[1, :6] == pytest.approx(
        slope * (at - THIRD), rel=1e-2, abs=1e-9
    )  # and its curvature


def test_two_interfaces_close_to_each_other_share_a_node() -> None:
    close = {"root": 0.0, "a": 0.2, "b": 0.2 + 0.5 * SHORTEST * BAR.length}
    mesh = BeamMesh(bar(KINDS, nodes=close), ["a", "b"])
    assert np.diff(mesh.nodes).min() > SHORTEST * BAR.length
    assert np.array_equal(mesh.dof("a"), mesh.dof("b"))


def test_every_interface_far_from_the_others_is_a_node_of_its_own() -> None:
    mesh = BeamMesh(with_node(THIRD + 2 * SHORTEST * BAR.length), ["third"])
    assert mesh.nodes[mesh.dof("third")[0] // 6] == pytest.approx(THIRD + 2 * SHORTEST * BAR.length, abs=1e-9)


def test_a_piece_of_too_short_elements_is_refused_by_name() -> None:
    long, short = replace(BAR, elements=8), replace(BAR, length=1e-5, elements=1)
    with pytest.raises(
        ValueError, match=r"body 'bar': the elements of pieces.1 are 1e-05 m .* least 5e-05 m"
    ):
        BeamMesh(replace(bar(), pieces=(long, short)))
    BeamMesh(replace(bar(), pieces=(long, replace(short, rigid=True))))  # stores no energy: none to round
