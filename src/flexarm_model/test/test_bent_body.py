"""A beam that gravity bends too far for its shapes is refused; cut in pieces it follows Euler's elastica."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arms import Array, arm, bar
from scipy.integrate import solve_bvp, trapezoid

from flexarm_model.manipulator.body_spec import Beam, RigidBody
from flexarm_model.manipulator.description import WORLD, Axis, Joint, ManipulatorConfig, NodeRef
from flexarm_model.served.linearize import PoseError, linearize
from flexarm_model.tree.reduced_tree import ReducedTree

LENGTH, G = 0.5, 9.81
EI = 70e9 * 0.010 * 0.004**3 / 12  # of the bar along y [N m^2]


def loaded(cuts: int, mass: float) -> ManipulatorConfig:
    """Return a level beam of so many equal bars end to end with a mass at its end, nearly without its own."""
    config = arm("planar")
    bodies: dict[str, Beam | RigidBody] = {}
    motor = Axis("rz", actuated=True, rotor_inertia=1.0, effort=100.0)
    joints, at = [], NodeRef(WORLD, "root")
    for k in range(cuts):
        bodies[f"bar_{k}"] = replace(bar(length=LENGTH / cuts, density=1.0), name=f"bar_{k}")
        joints.append(Joint(f"to_{k}", at, NodeRef(f"bar_{k}", "root"), np.eye(4), () if k else (motor,)))
        at = NodeRef(f"bar_{k}", "end")
    bodies["load"] = RigidBody("load", mass, np.zeros(3), np.zeros((3, 3)), {"root": np.zeros(3)})
    joints.append(Joint("weld", at, NodeRef("load", "root"), np.eye(4), ()))
    return replace(config, bodies=bodies, joints=tuple(joints), closures=(), sensors=(), home=np.zeros(1),
                   tip=NodeRef("load", "root"), modes=2, gravity=np.array([0, -G, 0]), poses={})  # fmt: skip


def elastica(mass: float) -> Array:
    """Return where the end of the beam rests [m], (2,): ``EI theta'' = m g cos(theta)``."""
    s = np.linspace(0, LENGTH, 50)
    found = solve_bvp(
        lambda s, y: [y[1], mass * G / EI * np.cos(y[0])], lambda a, b: [a[0], b[1]], s, np.zeros((2, 50))
    )
    s = np.linspace(0, LENGTH, 2001)
    theta = found.sol(s)[0]
    return np.array([trapezoid(f(theta), s) for f in (np.cos, np.sin)])


def rest(cuts: int, mass: float) -> Array:
    """Return where the end of the beam rests [m], (2,)."""
    tree = ReducedTree(loaded(cuts, mass), use_compiler=False)
    return tree.tip_pose(linearize(tree).q0)[:2, 3]


def test_a_beam_that_is_bent_as_far_as_it_may_be_follows_the_elastica() -> None:
    end, sag = elastica(0.8)
    assert 0.2 < -sag / LENGTH * 1.5 < 0.3  # the slope at the end of a beam with a load there is 1.5 sag / L
    assert rest(1, 0.8) == pytest.approx([end, sag], abs=0.04 * abs(sag))


def test_a_beam_that_rests_bent_too_far_is_refused_by_name_and_several_welded_are_not() -> None:
    with pytest.raises(
        PoseError, match=r"^pose \[0\.0\]: 'bar_0' rests bent, .* by 0\.\d+ rad .* welded end"
    ):
        rest(1, 1.2)
    end, sag = elastica(1.2)
    assert rest(3, 1.2) == pytest.approx([end, sag], abs=0.01 * abs(sag))


@pytest.mark.parametrize("mass", [4.0, 40.0])
def test_a_load_far_beyond_small_bending_is_no_model(mass: float) -> None:
    with pytest.raises(PoseError):
        rest(1, mass)
