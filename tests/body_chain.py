"""The bodies of a description put together joint by joint: a plain chain product, apart from the trees."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from flexarm_model.manipulator.body_spec import Beam
from flexarm_model.manipulator.description import Joint, ManipulatorConfig, NodeRef
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]
Values = dict[str, float]  # by the name of the axis; those left out are zero


@cache
def described(name: str) -> ManipulatorConfig:
    return load_config(find_manipulator(name))


@cache
def tree(name: str) -> ReducedTree:
    return ReducedTree(described(name), use_compiler=False)


def joint(name: str, of: str) -> Joint:
    config = described(of)
    return next(joint for joint in (*config.joints, *config.closures) if joint.name == name)


def node(config: ManipulatorConfig, ref: NodeRef) -> Array:
    """Return the position of a node in its unbent body, (3,)."""
    if ref.body == "world":
        return np.zeros(3)
    body = config.bodies[ref.body]
    if isinstance(body, Beam):
        return np.array([body.nodes[ref.node], 0.0, 0.0])
    return np.asarray(body.nodes[ref.node])


def shifted(T: Array, by: Array) -> Array:
    result = T.copy()
    result[:3, 3] += T[:3, :3] @ by
    return result


def moved(joint: Joint, values: Values) -> Array:
    """Return the end of a joint's axes in the node it starts from, (4, 4)."""
    T = joint.placement
    for axis in joint.axes:
        step, value = np.eye(4), values.get(f"{joint.name}.{axis.name}", 0.0)
        if axis.name[0] == "t":
            step["xyz".index(axis.name[1]), 3] = value
        else:
            step[:3, :3] = Rotation.from_euler(axis.name[1], value).as_matrix()
        T = T @ step
    return T


def bodies_placed(config: ManipulatorConfig, values: Values) -> tuple[dict[str, Array], float]:
    """Return the poses of all bodies, and how far the loops stay open [m and 1]."""
    placed = {"world": np.eye(4)}

    def at(ref: NodeRef) -> Array:
        return shifted(placed[ref.body], node(config, ref))

    for link in config.joints:
        end = at(link.parent) @ moved(link, values)
        placed[link.child.body] = shifted(end, -node(config, link.child))
    gaps = [abs(at(c.parent) @ moved(c, values) - at(c.child)).max() for c in config.closures]
    return placed, max(gaps, default=0.0)


def check(name: str, values: Values, expected: Array, tolerance: float) -> None:
    """Compare the tip of the plain chain and of the reduced tree with the closed form's, (4, 4)."""
    config = described(name)
    placed, gap = bodies_placed(config, values)
    assert gap <= tolerance
    plain = shifted(placed[config.tip.body], node(config, config.tip))
    np.testing.assert_allclose(plain, expected, atol=tolerance)
    reduced = tree(name)
    q = np.zeros(reduced.n_q)
    for axis, value in values.items():
        q[reduced.axis_names.index(axis)] = value
    assert abs(reduced.constraints(q)[0]).max(initial=0.0) <= tolerance
    np.testing.assert_allclose(reduced.tip_pose(q), expected, atol=tolerance)


def transform(R: Array, p: Array) -> Array:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = R, p
    return T
