"""A manipulator as rigid links and single-axis joints, bent bodies as chains of segments.

Along every beam stand stations; other bodies have one at each node. From one to the next a bent body moves by
segment joints (``segment_chain``). A closed loop is shown as the tree with
its closing joint cut: where the coordinates close the loop, both ends of the cut meet.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.display.segment_chain import SegmentChain
from flexarm_model.bodies.body_reduction import reduce_body
from flexarm_model.bodies.superelement import Superelement
from flexarm_model.manipulator.body_spec import Beam, BeamPiece, Body
from flexarm_model.manipulator.description import WORLD, Axis, Joint, NodeRef
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]

STATIONS = 10  # along every beam, beside its nodes
BASE, TOOL = "base", "tool"  # links: what stands still, and the tip
SAME = 1e-9  # m; stations closer than this are one


@dataclass(frozen=True)
class SegmentJoint:
    """One joint of the tree of links.

    Attributes:
        name: "joint.axis", "body.station.axis" or "link.fixed".
        parent, child: Links.
        origin: Of the joint in the parent link, (4, 4).
        axis: One of ``AXES``; empty for a fixed joint.
        limits: Of an axis of the description; None of a segment.
        body: That bends or is rigid between the two links; empty for axes of joints.
        section: Of the beam there; None of another body, and where its section is not known.
    """

    name: str
    parent: str
    child: str
    origin: Array
    axis: str = ""
    limits: Axis | None = None
    body: str = ""
    section: BeamPiece | None = None


class SegmentGraph:
    """Links, joints and the joints' values at any coordinates of the dynamics tree.

    Attributes:
        joints: Every parent before its children.
    """

    def __init__(self, tree: ReducedTree, stations: int = STATIONS) -> None:
        """Lay out one manipulator.

        Args:
            tree: The dynamics, for its bodies and the order of its coordinates.
            stations: Along every beam.
        """
        config = tree.config
        self._index = {name: i for i, name in enumerate(tree.coordinates)}
        self._elastic = {name: tree.elastic_coordinates(name) for name in tree.bodies}
        self._axes: dict[str, int] = {}
        self._chains: dict[str, SegmentChain] = {}
        self.joints: list[SegmentJoint] = []
        used = {ref for joint in (*config.joints, *config.closures) for ref in (joint.parent, joint.child)}
        for joint in config.joints:
            entry = self._add_axes(joint)
            body = config.bodies[joint.child.body]
            shapes = tree.bodies[body.name]
            if isinstance(body, Beam):
                interfaces = {ref.node for ref in used if ref.body == body.name}
                shapes = reduce_body(_with_stations(body, stations), interfaces)
            self._add_body(body, shapes, joint.child.node, entry)
        self.joints.append(_fixed(link_of(config.tip), TOOL, np.eye(4)))

    @property
    def moving(self) -> tuple[str, ...]:
        """Names of the joints that move, in the order of ``values``."""
        return tuple(joint.name for joint in self.joints if joint.axis)

    def values(self, q: Array) -> dict[str, float]:
        """Return the position of every moving joint [m or rad].

        Args:
            q: Coordinates of the tree, (n_q,).
        """
        found = {name: float(q[index]) for name, index in self._axes.items()}
        for body, chain in self._chains.items():
            index = self._elastic[body]
            found |= chain.values(q[index.start : index.stop])
        return {name: found[name] for name in self.moving}

    def _add_axes(self, joint: Joint) -> str:
        """Add the axes of a joint; return the link that the child's node is."""
        link, origin, child = link_of(joint.parent), joint.placement, link_of(joint.child)
        for axis in joint.axes:
            name = f"{joint.name}.{axis.name}"
            following = child if axis is joint.axes[-1] else f"{name}.link"
            self.joints.append(SegmentJoint(name, link, following, origin, axis.name, axis))
            self._axes[name] = self._index[name]
            link, origin = following, np.eye(4)
        if not joint.axes:
            self.joints.append(_fixed(link, child, origin))
        return child

    def _add_body(self, spec: Body, shapes: Superelement, entry: str, link: str) -> None:
        chain = SegmentChain(shapes, list(_pairs(shapes, entry)))
        self._chains[shapes.name] = chain
        for (a, b), rest, axes in zip(chain.pairs, chain.rest, chain.axes, strict=True):
            parent, child = link if a == entry else f"{shapes.name}.{a}", f"{shapes.name}.{b}"
            origin, section = rest, _section(spec, shapes, a, b)
            for axis in axes:
                name = f"{child}.{axis}"
                following = child if axis == axes[-1] else f"{name}.link"
                joint = SegmentJoint(name, parent, following, origin, axis, body=shapes.name, section=section)
                self.joints.append(joint)
                parent, origin = following, np.eye(4)
            if not axes:
                fixed = _fixed(parent, child, origin, shapes.name)
                self.joints.append(replace(fixed, section=section))


def link_of(node: NodeRef) -> str:
    """Return the link that a node of the description is."""
    return BASE if node.body == WORLD else str(node)


def _fixed(parent: str, child: str, origin: Array, body: str = "") -> SegmentJoint:
    return SegmentJoint(f"{child}.fixed", parent, child, origin, body=body)


def _section(body: Body, shapes: Superelement, a: str, b: str) -> BeamPiece | None:
    """Return the piece of a beam half way between two nodes; None where it is rigid, of whatever section."""
    if not isinstance(body, Beam):
        return None
    middle = (shapes.nodes[a].r[0] + shapes.nodes[b].r[0]) / 2.0
    ends = np.cumsum([piece.length for piece in body.pieces])
    piece = body.pieces[min(int(np.searchsorted(ends, middle)), len(body.pieces) - 1)]
    return None if piece.rigid else piece


def _with_stations(beam: Beam, count: int) -> Beam:
    """Return the beam with more nodes, evenly spaced, none where there is one already."""
    there = np.array(list(beam.nodes.values()))
    wanted = np.linspace(0.0, beam.length, count + 1)[1:]
    more = {f"s{i + 1}": float(x) for i, x in enumerate(wanted) if abs(there - x).min() > SAME}
    return replace(beam, nodes={**beam.nodes, **{_unused(name, beam): x for name, x in more.items()}})


def _unused(name: str, beam: Beam) -> str:
    """Return the name, with as many "_" behind it as no node of the description has."""
    while name in beam.nodes:
        name += "_"
    return name


def _pairs(shapes: Superelement, entry: str) -> Iterator[tuple[str, str]]:
    """Yield neighbouring nodes, outwards from the entry: along x where all lie on it, else as a star."""
    r = np.array([shape.r for shape in shapes.nodes.values()])
    names = list(shapes.nodes)
    if shapes.n == 0 or abs(r[:, 1:]).max(initial=0.0) > SAME:
        yield from ((entry, name) for name in names if name != entry)
        return
    order = [names[i] for i in np.argsort(r[:, 0], kind="stable")]
    at = order.index(entry)
    yield from zip(order[at:], order[at + 1 :], strict=False)
    yield from zip(order[at::-1], order[at - 1 :: -1] if at else [], strict=False)
