"""Where a joint stands: ``position`` and ``orientation`` in its parent's node, or a line of a table.

``dh`` is the constant step from the axis before to this one, as a table of Denavit and Hartenberg has it (see
``kinematics.dh``): the joint's own line of a modified table, the line before of a standard one, whose frames
lie at the far end of their links.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from flexarm_model.kinematics.dh import DhRow, ModifiedDhRow
from flexarm_model.numeric.rotation import rotation_from_rpy
from flexarm_model.settings.strict_yaml import Section

Array = NDArray[np.float64]

CONVENTIONS: dict[str, Callable[[float, float, float, float], DhRow]] = {
    "standard": DhRow,
    "modified": ModifiedDhRow,
}


def read_placement(section: Section) -> Array:
    """Read the pose of a joint in its parent's node, (4, 4).

    Raises:
        ConfigError: A value is wrong, or both ways are taken; see ``strict_yaml``.
    """
    if section.has("dh"):
        for key in ("position", "orientation"):
            if section.has(key):
                raise section.error(
                    key, section.take(key), "dh says where the joint stands; give one of them"
                )
        return _read_step(section.section("dh"))
    placement = np.eye(4)
    placement[:3, :3] = rotation_from_rpy(section.quantities("orientation", ["angle"] * 3, (0.0, 0.0, 0.0)))
    placement[:3, 3] = section.quantities("position", ["length"] * 3, (0.0, 0.0, 0.0))
    return placement


def _read_step(section: Section) -> Array:
    """Read a line of a table, what is left out of it being zero, and return its step at q = 0, (4, 4)."""
    row = CONVENTIONS[section.choice("convention", tuple(CONVENTIONS))]
    d, a = (section.quantity(key, "length", 0.0) for key in ("d", "a"))
    alpha, offset = (section.quantity(key, "angle", 0.0) for key in ("alpha", "offset"))
    section.done()
    return row(d, a, alpha, offset).step(0.0)
