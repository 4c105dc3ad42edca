"""Where modes store their energy: everything is accounted for, once, under the right name."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arms import arm, bar, tip_mass, tree, with_modes
from scipy.spatial.transform import Rotation

from flexarm_model.manipulator.body_spec import Beam, RigidBody
from flexarm_model.manipulator.description import WORLD, Axis, Joint, ManipulatorConfig, NodeRef
from flexarm_model.modal.energy_shares import GRAVITY, _kinds, energy_shares
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree


def sprung_bar(stiffness: float) -> ManipulatorConfig:
    """A bar that bends two ways and twists, on a sprung hinge about z, on a motor about z, no gravity."""
    planar = arm("planar")
    body = bar(("bend_y", "bend_z", "torsion"), point_masses=tip_mass(0.1))
    mount = RigidBody("mount", 0.01, np.zeros(3), 1e-5 * np.eye(3), {"root": np.zeros(3)})
    base, top, root = NodeRef(WORLD, "root"), NodeRef("mount", "root"), NodeRef("bar", "root")
    joints = (
        Joint("motor", base, top, np.eye(4), (Axis("rz", actuated=True),)),
        Joint("hinge", top, root, np.eye(4), (Axis("rz", stiffness=stiffness),)),
    )
    return replace(
        planar,
        bodies={"mount": mount, "bar": body},
        joints=joints,
        sensors=(),
        tip=NodeRef("bar", "end"),
        home=np.zeros(1),
        modes=5,
        poses={},
    )


def served(config: ManipulatorConfig) -> tuple[ReducedTree, dict[str, np.ndarray]]:
    arm_tree = ReducedTree(config, use_compiler=False)
    shares = energy_shares(arm_tree, linearize(arm_tree))
    return arm_tree, dict(zip(shares.names, shares.share.T, strict=True))


def test_without_gravity_springs_and_bodies_hold_all_of_it() -> None:
    for name in ("single_link", "planar"):
        shares = energy_shares(tree(name), linearize(tree(name)))
        assert shares.share[:, shares.names.index(GRAVITY)] == pytest.approx(0.0, abs=1e-9)
        assert (shares.share[:, :-1] >= 0.0).all()


def test_a_spring_in_series_holds_the_share_of_its_compliance() -> None:
    """A mass on a beam on a hinge: under the tip force both carry F, so shares are as compliances."""
    config = sprung_bar(2.0)
    body = config.bodies["bar"]
    assert isinstance(body, Beam)
    piece, length = body.pieces[0], body.length
    light = replace(body, pieces=(replace(piece, density=1e-3),), point_masses=tip_mass(1.0))
    config = replace(config, bodies={"mount": config.bodies["mount"], "bar": light}, modes=2)
    _, share = served(config)
    compliance = {
        "bar bends along y": length**3 / (3 * piece.E * piece.I_z),
        "spring of hinge.rz": length**2 / 2.0,
    }
    total = sum(compliance.values())
    [mode] = np.flatnonzero(share["spring of hinge.rz"] > 0.01)
    for name, value in compliance.items():
        assert share[name][mode] == pytest.approx(value / total, rel=1e-3)  # the mount's and the bar's mass


def test_bending_either_way_and_twisting_have_names_of_their_own() -> None:
    _, share = served(sprung_bar(1e6))  # hinge as good as locked
    assert {"spring of hinge.rz", "bar bends along y", "bar bends along z", GRAVITY} <= set(share)
    named = np.array([share["bar bends along y"], share["bar bends along z"]])
    assert np.sort(named, axis=0)[-1][:2] == pytest.approx(1.0, abs=1e-3)  # each mode one way
    assert {int(np.argmax(named[:, k])) for k in range(2)} == {0, 1}


def test_gravity_holds_what_is_left() -> None:
    arm_tree = tree("spatial")
    shares = energy_shares(arm_tree, linearize(arm_tree))
    assert shares.share.sum(axis=1) == pytest.approx(1.0)
    assert abs(shares.share[:, -1]).max() < 0.05  # a stiff arm
    assert abs(shares.share[:, -1]).max() > 1e-6


def test_the_largest_are_listed_largest_first() -> None:
    shares = energy_shares(tree("spatial"), linearize(tree("spatial")))
    listed = shares.largest(0, 0.05)
    values = [share for _, share in listed]
    assert values == sorted(values, reverse=True) and min(values) >= 0.05


@pytest.mark.parametrize(
    ("turned", "bends_y", "bends_z"),
    [
        ([0.0, 0.0, 0.0], "bends along y", "bends along z"),
        ([0.0, 0.0, 90.0], "bends along x", "bends along z"),
        ([0.0, -90.0, 0.0], "bends along y", "bends along x"),
        ([0.0, 0.0, 45.0], "bends along x and -y", "bends along z"),
    ],
)
def test_a_body_that_lies_another_way_in_its_frame_bends_and_twists_as_it_did(
    turned: list[float], bends_y: str, bends_z: str
) -> None:
    """A bar along x as files may hold it, and its nodes turned into another body frame (`orientation`)."""
    arm_tree = ReducedTree(with_modes(sprung_bar(1e6), 12), use_compiler=False)
    R, body = Rotation.from_euler("xyz", turned, degrees=True).as_matrix(), arm_tree.bodies["bar"]
    nodes = {
        name: replace(node, r=R @ node.r, Phi=R @ node.Phi, Psi=R @ node.Psi)
        for name, node in body.nodes.items()
    }
    said = {"bends along y": bends_y, "bends along z": bends_z}
    straight = _kinds(body)
    assert {"twists", *said} <= set(straight)
    assert _kinds(replace(body, nodes=nodes)) == [said.get(kind, kind) for kind in straight]
