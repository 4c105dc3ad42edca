"""How far off a linear model's accelerations are while axes turn: it leaves out ``r omega^2``.

An accelerometer at a distance r from an axis that turns at omega feels it along the boom. A linear filter
that believes the sensor's noise alone takes it for an acceleration of the axis that points there, a telescope
say. At the end of links of lengths l_k that turn at rates omega_k it is at most ``sum_k l_k omega_k^2``.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from flexarm_model.manipulator.description import WORLD, Joint, ManipulatorConfig, NodeRef
from flexarm_model.settings.units import is_sliding

SIGMAS = 6.0  # that the filter may be off by at most: its gate on a tour is ten


def centripetal_error(config: ManipulatorConfig, rates: Mapping[str, float]) -> float:
    """Return one sigma of the accelerations that a linear model leaves out [m/s^2], two digits of it.

    Args:
        config: The arm.
        rates: Fastest velocity of the actuated axes on their moves, by name [rad/s or m/s].
    """
    sites = [sensor.site for sensor in config.sensors if sensor.kind == "accelerometer"]
    most = max((_most(config, NodeRef(*site.split(".")), rates) for site in sites), default=0.0)
    return float(f"{most / SIGMAS:.2g}")


def _most(config: ManipulatorConfig, node: NodeRef, rates: Mapping[str, float]) -> float:
    """Return the bound at a node [m/s^2], all axes turning one way."""
    placing = {joint.child.body: joint for joint in config.joints}
    links: list[tuple[Joint, float]] = []  # from the node inwards: a joint, and how long what it moves is
    while node.body != WORLD:
        joint = placing[node.body]
        links.append((joint, _apart(config, node, joint.child) + _slid(config, joint)))
        node = joint.parent
    omega = most = 0.0
    for joint, length in reversed(links):
        most += float(np.linalg.norm(joint.placement[:3, 3])) * omega**2
        omega += sum(
            rates.get(f"{joint.name}.{axis.name}", 0.0) for axis in joint.axes if axis.name[0] == "r"
        )
        most += length * omega**2
    return most


def _apart(config: ManipulatorConfig, one: NodeRef, other: NodeRef) -> float:
    """Return the distance of two nodes of a body [m]."""
    nodes = config.bodies[one.body].nodes
    return float(np.linalg.norm(np.subtract(nodes[one.node], nodes[other.node])))


def _slid(config: ManipulatorConfig, joint: Joint) -> float:
    """Return how far the sliding motors of a joint are out at most, at any named pose [m]."""
    poses = np.abs([config.home, *config.poses.values()]).max(axis=0)
    out = dict(zip(config.actuated, poses, strict=True))
    sliding = [f"{joint.name}.{axis.name}" for axis in joint.axes if is_sliding(axis.name)]
    return float(sum(out.get(name, 0.0) for name in sliding))
