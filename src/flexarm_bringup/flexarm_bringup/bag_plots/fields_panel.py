"""A panel for any topic: every number of its messages over time, as far as they fit."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from flexarm_bringup.bag_plots.panel import Panel, line, stacked
from flexarm_bringup.bag_plots.series import BagSeries

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Plot

SHOWN = 8  # fields of a topic
LONGEST = 12  # elements of a field that are drawn
SKIPPED = ("header", "covariance")  # fields, or the ends of their names


def fields_panel(topic: str, series: BagSeries) -> Panel | None:
    """Return the panel of an absolute topic; None when its messages hold no numbers."""
    names = list(dict.fromkeys(name for name, _ in _numbers(series.messages(topic)[0], "")))[:SHOWN]
    if not names:
        return None

    def draw(plot: Plot, series: BagSeries) -> None:
        """Draw one strip per field."""
        t, rows = series.times(topic), [dict(_numbers(msg, "")) for msg in series.messages(topic)]
        for name, axes in zip(names, stacked(plot, len(names)), strict=True):
            width = min(max(np.size(row.get(name, ())) for row in rows), LONGEST)
            for i in range(width):
                values = [np.ravel(row.get(name, ())) for row in rows]
                line(axes, t, np.array([v[i] if i < v.size else np.nan for v in values], float))
            axes.set_ylabel(name, fontsize=8)

    height = 1.2 + 1.1 * len(names)
    return Panel(topic.strip("/").replace("/", "_"), f"Fields of {topic}.", (topic,), draw, height=height)


def _numbers(value: Any, path: str) -> Iterator[tuple[str, Any]]:
    """Yield the numeric fields of a message, "pose.position.x", headers and covariances left out."""
    if is_dataclass(value):
        for item in fields(value):
            if item.name.startswith("__") or item.name.isupper() or item.name.endswith(SKIPPED):
                continue
            yield from _numbers(getattr(value, item.name), f"{path}.{item.name}".lstrip("."))
    else:
        numbers = np.asarray(value) if isinstance(value, bool | int | float | np.ndarray) else np.zeros(0)
        if numbers.size and numbers.dtype.kind in "fiub":
            yield path, numbers
