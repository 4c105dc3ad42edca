"""Drawings of the mechanism: at rest, and deformed by a mode.

The world is seen along its axes: one view where everything lies and moves in one plane, else the two that
show most.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.model_view.mechanism_lines import Line, MechanismLines, all_points
from flexarm_bringup.page.figures import COLOURS, INK, Figure, drawing, to_figure
from flexarm_model.manipulator.description import WORLD

Array = NDArray[np.float64]

SHARE = 0.12  # of the mechanism's size: largest displacement drawn
COLUMNS = 3  # modes side by side
FLAT = 0.02  # of the size: what is less deep is seen from one side only
VIEWS = ((0, 1), (0, 2), (1, 2))  # horizontal and vertical axis of each view


@dataclass(frozen=True)
class Shape:
    """A mode drawn: the lines at rest, moved to both sides, and by how much.

    Attributes:
        rest: Undeformed.
        there, back: Deformed to either side.
        scale: Amplitude of the modal coordinate that is drawn.
        joints: Where the joints are, (n_joints, 3).
    """

    rest: Sequence[Line]
    there: Sequence[Line]
    back: Sequence[Line]
    scale: float
    joints: Array


def mode_shape(mechanism: MechanismLines, q0: Array, direction: Array) -> Shape:
    """Return the mechanism moved along a direction of its coordinates.

    Args:
        mechanism: What to draw.
        q0: Coordinates at rest, ``ReducedModel.q0``, (n_q,).
        direction: A column of ``ReducedModel.Phi``, (n_q,).
    """
    rest = mechanism.lines(q0)
    unit = mechanism.displaced(q0, direction, 1.0)
    size = float(np.ptp(all_points(rest), axis=0).max())
    largest = float(np.linalg.norm(all_points(unit) - all_points(rest), axis=1).max())
    scale = SHARE * size / largest if largest > 0.0 else 0.0
    there, back = (mechanism.displaced(q0, direction, side * scale) for side in (1.0, -1.0))
    return Shape(rest, there, back, scale, mechanism.joints(q0))


def best_views(lines: Sequence[Line], moved: Sequence[Line] = ()) -> list[tuple[int, int]]:
    """Return the world axes of the views that show most: one for what is flat, else two.

    Args:
        lines: At rest.
        moved: The same, deformed.
    """
    at = all_points(lines)
    extent = np.ptp(at, axis=0)
    motion = abs(all_points(moved) - at).max(axis=0) if moved else np.zeros(3)
    depth = np.maximum(
        extent / max(extent.max(), np.finfo(float).tiny), motion / max(motion.max(), np.finfo(float).tiny)
    )
    shown = sorted(VIEWS, key=lambda view: -depth[view[0]] * depth[view[1]] - 1e-3 * motion[list(view)].sum())
    flat = np.flatnonzero(depth < FLAT)
    return shown[:1] if flat.size else shown[:2]


def draw_lines(axis: Any, lines: Sequence[Line], view: tuple[int, int], **style: Any) -> None:
    """Draw polylines into a matplotlib axis, seen along the third world axis."""
    for line in lines:
        if np.ptp(line.points, axis=0).max() > 0.0:
            axis.plot(line.points[:, view[0]], line.points[:, view[1]], solid_capstyle="round", **style)


def draw_shape(axis: Any, shape: Shape, view: tuple[int, int], colour: str = COLOURS[0]) -> None:
    """Draw a mode into a matplotlib axis: at rest grey, one side strong, the other faint."""
    ground = [line for line in shape.rest if line.body == WORLD]
    draw_lines(axis, ground, view, color=INK, alpha=0.2, linewidth=0.8, linestyle=":")
    faint, strong = {"alpha": 0.35, "linewidth": 1.2}, {"linewidth": 2.0}
    for lines, ink, style in (
        (shape.rest, INK, faint),
        (shape.back, colour, faint),
        (shape.there, colour, strong),
    ):
        draw_lines(axis, [line for line in lines if line.body != WORLD], view, color=ink, **style)
    axis.plot(shape.joints[:, view[0]], shape.joints[:, view[1]], "o", color=INK, markersize=2.5, alpha=0.5)
    axis.set_aspect("equal", adjustable="datalim")
    axis.set(xlabel=f"{'xyz'[view[0]]} [m]", ylabel=f"{'xyz'[view[1]]} [m]")


def mode_figure(shape: Shape, title: str, caption: str) -> Figure:
    """Return the drawing of one mode in its best view or two.

    Args:
        shape: What to draw.
        title: Above the drawing.
        caption: One sentence below it.
    """
    views = best_views(shape.rest, shape.there)
    with drawing(9.0, 3.4) as plot:
        for number, view in enumerate(views):
            axis = plot.add_subplot(1, len(views), number + 1)
            draw_shape(axis, shape, view)
        plot.axes[0].set_title(title)
        return to_figure(plot, caption)


def modes_figure(shapes: Sequence[Shape], titles: Sequence[str], caption: str) -> Figure:
    """Return several modes side by side, each in its best view.

    Args:
        shapes: What to draw.
        titles: Above each.
        caption: One sentence below all.
    """
    rows = -(-len(shapes) // COLUMNS)
    with drawing(9.0, 2.8 * rows) as plot:
        for number, (shape, title) in enumerate(zip(shapes, titles, strict=True)):
            axis = plot.add_subplot(rows, COLUMNS, number + 1)
            draw_shape(axis, shape, best_views(shape.rest, shape.there)[0])
            axis.set_title(title)
        return to_figure(plot, caption)
