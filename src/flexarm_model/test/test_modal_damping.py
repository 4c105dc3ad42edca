"""A damping ratio said of bodies and springs becomes the ratio of the arm's modes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arms import arm
from scipy.linalg import eigh

from flexarm_model.manipulator.body_spec import Beam
from flexarm_model.manipulator.description import ManipulatorConfig
from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

ARMS = ("planar", "spatial")


def with_ratios(name: str, ratios: list[float]) -> ManipulatorConfig:
    """Return a test arm without other damping whose beams have these ratios."""
    config = arm(name)
    beams = [body for body in config.bodies.values() if isinstance(body, Beam)]
    bodies = {
        body.name: replace(body, damping_ratio=ratio) for body, ratio in zip(beams, ratios, strict=False)
    }
    joints = tuple(
        replace(joint, axes=tuple(replace(axis, damping=0.0) for axis in joint.axes))
        for joint in config.joints
    )
    return replace(config, bodies={**config.bodies, **bodies}, joints=joints, gravity=np.zeros(3))


@pytest.mark.parametrize("name", ARMS)
def test_bodies_of_one_ratio_give_every_mode_that_ratio(name: str) -> None:
    model = linearize(ReducedTree(with_ratios(name, [0.02] * 9), use_compiler=False))
    assert model.zeta == pytest.approx(np.full(model.zeta.size, 0.02), rel=1e-3)


@pytest.mark.parametrize("name", ARMS)
def test_the_segment_tree_damps_its_modes_alike(name: str) -> None:
    config = with_ratios(name, [0.02] * 9)
    tree = SegmentTree(config, 4)
    q = tree.close(config.home)
    e = np.setdiff1d(np.arange(tree.n_q), tree.actuated)
    value, Phi = eigh(tree.K[np.ix_(e, e)], tree.mass_matrix(q)[np.ix_(e, e)])
    zeta = np.einsum("ik,ij,jk->k", Phi, tree.D[np.ix_(e, e)], Phi) / (2 * np.sqrt(value))
    assert zeta == pytest.approx(np.full(zeta.size, 0.02), rel=1e-6)


def test_a_mode_takes_after_the_body_that_it_strains() -> None:
    tree = ReducedTree(with_ratios("planar", [0.01, 0.05]), use_compiler=False)
    model = linearize(tree)
    e = range(len(tree.axes), tree.n_q)
    for k, zeta in enumerate(model.zeta):
        phi = model.Phi[:, len(model.theta_names) + k]
        strain = np.array([tree.K[i, i] * phi[i] ** 2 for i in e])
        ratio = np.array([tree.bodies[tree.coordinates[i].split(".")[0]].damping_ratio for i in e])
        assert zeta == pytest.approx(float(strain @ ratio / strain.sum()), rel=1e-2)
        assert 0.01 < zeta < 0.05


def test_what_strains_nothing_is_not_damped() -> None:
    model = linearize(ReducedTree(with_ratios("planar", [0.02] * 9), use_compiler=False))
    n = len(model.theta_names)
    assert abs(model.D[:n, :n]).max() < 1e-9 * abs(model.M[:n, :n]).max()
