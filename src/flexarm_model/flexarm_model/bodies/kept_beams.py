"""Beams that were reduced before: six strips of one make are reduced once, and not again for another tree.

A beam's superelement follows from its description, its name aside, and from which nodes joints use. The last
few are kept for the process, and nobody can write into them.
"""

from __future__ import annotations

import pickle
from collections.abc import Collection
from dataclasses import fields, replace

import numpy as np

from flexarm_model.bodies.beam_superelement import reduce_beam
from flexarm_model.bodies.superelement import NodeShape, Superelement
from flexarm_model.manipulator.body_spec import Beam

_MOST = 64
_KEPT: dict[bytes, Superelement] = {}


def reduce_kept(beam: Beam, interfaces: Collection[str], *, second_order: bool = True) -> Superelement:
    """Reduce a beam as ``reduce_beam`` does, or return what that gave for one of another name alone."""
    described = pickle.dumps((replace(beam, name=""), sorted(interfaces), second_order))  # every value
    found = _KEPT.get(described)
    if found is None:
        found = reduce_beam(beam, interfaces, second_order=second_order)
        _protect(found, *found.nodes.values())
        while len(_KEPT) >= _MOST:
            _KEPT.pop(next(iter(_KEPT)), None)
        _KEPT[described] = found
    return replace(found, name=beam.name)


def _protect(*parts: Superelement | NodeShape) -> None:
    for part in parts:
        for field in fields(part):
            value = getattr(part, field.name)
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
