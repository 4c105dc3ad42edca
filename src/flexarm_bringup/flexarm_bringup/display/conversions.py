"""The bent arm as messages for a viewer: markers of links, joints and tip, positions of segment joints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from geometry_msgs.msg import Point
from numpy.typing import NDArray
from sensor_msgs.msg import JointState
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from flexarm_bringup.display.ellipsoid import Ellipsoid
from flexarm_bringup.model_view.mechanism_lines import Line

Array = NDArray[np.float64]

FRAME = "base"
LINK_WIDTH, JOINT_SIZE, TIP_SIZE = 0.012, 0.025, 0.02  # of the arm's size
PLAN_WIDTH = 0.005  # of the arm's size
DOUBTED = "tip, 3 sigma"
NO_PLAN = np.zeros((0, 3))
LEAST = 1e-4  # m; smallest axis of the tip's ellipsoid that is drawn
ELASTIC, RIGID, JOINT, TIP, DOUBT, PLAN = (
    (0.20, 0.47, 0.80, 1.0),
    (0.45, 0.45, 0.45, 1.0),
    (0.15, 0.15, 0.15, 1.0),
    (0.90, 0.35, 0.10, 1.0),
    (0.90, 0.35, 0.10, 0.3),
    (0.10, 0.60, 0.30, 1.0),
)


def markers_msg(  # noqa: PLR0913, everything that is drawn
    lines: Sequence[Line],
    elastic: frozenset[str],
    joints: Array,
    tip: Array,
    doubt: Ellipsoid | None,
    plan: Array = NO_PLAN,
) -> MarkerArray:
    """Return the arm as markers in the frame "base".

    Args:
        lines: Its bodies.
        elastic: Names of those that bend.
        joints: Where it has joints [m], (n, 3).
        tip: Where its tip is [m], (3,).
        doubt: Three sigma of the tip's position; None where it is not known.
        plan: Where the tip will go by the controller's plan [m], (k, 3); empty without one.
    """
    points = np.concatenate([line.points for line in lines])
    size = float(np.ptp(points, axis=0).max(initial=0.0)) or 1.0
    found: list[Marker] = []
    for line in lines:
        colour = ELASTIC if line.body in elastic else RIGID
        marker = _marker(f"link {line.body}", len(found), Marker.LINE_STRIP, colour)
        marker.scale.x = LINK_WIDTH * size
        marker.points = _points(line.points)
        found.append(marker)
    spheres = _marker("joints", 0, Marker.SPHERE_LIST, JOINT)
    spheres.scale.x = spheres.scale.y = spheres.scale.z = JOINT_SIZE * size
    spheres.points = _points(joints)
    at_tip = _sphere("tip", tip, np.full(3, TIP_SIZE * size), TIP)
    around = _around(tip, doubt)
    return MarkerArray(markers=[*found, spheres, at_tip, around, _path(plan, PLAN_WIDTH * size)])


def _around(tip: Array, doubt: Ellipsoid | None) -> Marker:
    """Return the doubt around the tip, or what takes it away where it is not known."""
    if doubt is None:
        marker = _sphere(DOUBTED, tip, np.full(3, LEAST), DOUBT)
        marker.action = Marker.DELETE
        return marker
    marker = _sphere(DOUBTED, tip, np.maximum(2.0 * doubt.half_axes, LEAST), DOUBT)
    turn = marker.pose.orientation
    turn.x, turn.y, turn.z, turn.w = doubt.turn
    return marker


def nothing_msg() -> MarkerArray:
    """Return what takes all markers of the arm away."""
    return MarkerArray(markers=[Marker(action=Marker.DELETEALL)])


def _path(points: Array, width: float) -> Marker:
    """Return a line, or what takes it away where there are no points."""
    marker = _marker("tip, planned", 0, Marker.LINE_STRIP, PLAN)
    marker.scale.x, marker.points = width, _points(points)
    marker.action = Marker.ADD if len(points) > 1 else Marker.DELETE
    return marker


def segments_msg(positions: Mapping[str, float], stamp: Any) -> JointState:
    """Return the positions of the segment joints."""
    msg = JointState(name=list(positions), position=list(positions.values()))
    msg.header.stamp, msg.header.frame_id = stamp, FRAME
    return msg


def _marker(namespace: str, number: int, kind: int, colour: Sequence[float]) -> Marker:
    marker = Marker(ns=namespace, id=number, type=kind, action=Marker.ADD)  # stamp zero: the newest there is
    marker.header.frame_id = FRAME
    marker.pose.orientation.w = 1.0
    marker.color = ColorRGBA(**dict(zip("rgba", colour, strict=True)))
    return marker


def _sphere(name: str, at: Array, axes: Array, colour: Sequence[float]) -> Marker:
    marker = _marker(name, 0, Marker.SPHERE, colour)
    marker.pose.position = _points([at])[0]
    marker.scale.x, marker.scale.y, marker.scale.z = axes.tolist()
    return marker


def _points(points: Array | Sequence[Array]) -> list[Point]:
    return [Point(x=float(x), y=float(y), z=float(z)) for x, y, z in points]
