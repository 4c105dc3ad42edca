"""From a body of the description to its superelement: one reducer per type of body."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Collection
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from flexarm_model.bodies.kept_beams import reduce_kept
from flexarm_model.bodies.scaled_superelement import Scales, scale_superelement
from flexarm_model.bodies.sid_file import read_sid
from flexarm_model.bodies.superelement import NodeShape, Superelement
from flexarm_model.manipulator.body_spec import Beam, Body, RigidBody
from flexarm_model.manipulator.imported_body import ImportedBody, SuperelementBody
from flexarm_model.settings.strict_yaml import ConfigError

Reducer = Callable[[Any, Collection[str]], Superelement]


def reduce_body(body: Body, interfaces: Collection[str]) -> Superelement:
    """Reduce a body.

    Args:
        body: Any body of a description.
        interfaces: Its nodes that joints use, "root" among them or not.

    Raises:
        ConfigError: The body cannot be reduced as asked; the message names it.
        ValueError: It has no such node.
    """
    return _reduce(_REDUCERS[type(body)], body, interfaces)


def reduce_to_first_order(body: Body, interfaces: Collection[str]) -> Superelement:
    """Reduce a body for a linear model: without second-order fields, so that many modes cost little.

    Arguments and errors are those of ``reduce_body``.
    """
    return _reduce(_FIRST_ORDER[type(body)], body, interfaces)


class KeptReductions:
    """Reduces bodies as ``reduce_body`` does, each again only when its description or its use has changed."""

    def __init__(self) -> None:
        """Start with none."""
        self._kept: dict[str, tuple[bytes, Superelement]] = {}

    def __call__(self, body: Body, interfaces: Collection[str]) -> Superelement:
        """Reduce a body; see ``reduce_body``."""
        described = pickle.dumps((body, sorted(interfaces)))  # exact, and names every value
        before = self._kept.get(body.name)
        if before is None or before[0] != described:
            before = self._kept[body.name] = described, reduce_body(body, interfaces)
        return before[1]


def _reduce(reducer: Reducer, body: Body, interfaces: Collection[str]) -> Superelement:
    _refuse_unknown(body, interfaces)
    try:
        return reducer(body, interfaces)
    except ValueError as error:  # of the description or of a file it names, wherever it is seen
        raise ConfigError(str(error)) from error


def _refuse_unknown(body: Body, interfaces: Collection[str]) -> None:
    """Refuse interfaces that are not nodes of the body: without them it would be held elsewhere."""
    if isinstance(interfaces, str):
        raise ValueError(f"body '{body.name}': interfaces: expected a list of nodes, not '{interfaces}'")
    if unknown := sorted(set(interfaces) - set(body.nodes)):
        names = ", ".join(body.nodes) or "none"
        raise ValueError(f"body '{body.name}': no node {', '.join(unknown)}; its nodes: {names}")


def _reduce_rigid(body: RigidBody, interfaces: Collection[str]) -> Superelement:
    second = np.trace(body.inertia) / 2 * np.eye(3) - body.inertia + body.mass * np.outer(body.com, body.com)
    none, empty, flat = np.zeros((3, 0)), np.zeros((0, 0)), np.zeros((3, 0, 0))
    nodes = {name: NodeShape(r, none, none, flat, flat, none) for name, r in body.nodes.items()}
    s = (body.mass * body.com)[None]
    return Superelement(body.name, body.mass, s, second[None, None], np.zeros(0), empty, empty, nodes)


def _reduce_imported(body: ImportedBody, interfaces: Collection[str]) -> Superelement:
    from flexarm_model.fe_import.imported_superelement import reduce_imported  # loads SciPy

    return reduce_imported(body, interfaces)


def _read_superelement(body: SuperelementBody, interfaces: Collection[str]) -> Superelement:
    scales = Scales(body.stiffness_scale, body.mass_scale, body.damping_scale)
    return scale_superelement(replace(read_sid(body.path), name=body.name), scales)


_REDUCERS: dict[type, Reducer] = {
    RigidBody: _reduce_rigid,
    Beam: reduce_kept,
    ImportedBody: _reduce_imported,
    SuperelementBody: _read_superelement,
}
_FIRST_ORDER: dict[type, Reducer] = {**_REDUCERS, Beam: partial(reduce_kept, second_order=False)}
