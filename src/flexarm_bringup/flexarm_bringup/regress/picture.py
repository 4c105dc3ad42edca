"""A divergence drawn: the field that differs first, expected and found, and how far every topic is off."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.bag_plots.panel import line, stacked
from flexarm_bringup.bags.bag_reader import Bag, decode
from flexarm_bringup.page.figures import Figure, drawing, to_figure
from flexarm_bringup.regress.judge import Verdict
from flexarm_bringup.replaying.compare import Divergence, grouped

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Plot

Array = NDArray[np.float64]
WIDTH, HEIGHT = 9.0, 6.0  # inch
DPI = 110
S_PER_NS = 1e-9
FIRST: dict[str, Any] = {"color": "#c0392b", "linewidth": 1.0, "linestyle": "--"}


def figure(verdict: Verdict, name: str) -> Figure:
    """Return the divergence of a case, called so, as a figure of the page."""
    with drawing(WIDTH, HEIGHT) as plot:
        _draw(plot, verdict)
        return to_figure(plot, f"{name}: {verdict.reason}")


def write_picture(verdict: Verdict, folder: Path, name: str) -> Path:
    """Write the divergence of a case as a PNG into a folder; return its path.

    Args:
        verdict: What diverged.
        folder: Created if need be.
        name: Of the case; one with slashes is drawn into folders of the folder.

    Raises:
        OSError: It cannot be written.
    """
    path = folder / f"{name}.png"
    path.parent.mkdir(parents=True, exist_ok=True)
    with drawing(WIDTH, HEIGHT) as plot:
        _draw(plot, verdict)
        plot.suptitle(f"{name}: {verdict.reason}"[:110], fontsize=9)
        plot.savefig(path, dpi=DPI, facecolor="white")
    return path


def field_series(bag: Bag | None, topic: str, field: str) -> tuple[Array, Array]:
    """Return stamps [s] and values of a field such as "sensors[2].innovation[0]"; no points for text."""
    if bag is None:
        return np.empty(0), np.empty(0)
    groups = grouped(bag, [topic])
    points = [
        (stamp_ns * S_PER_NS, _value(decode(r), field)) for (_, stamp_ns), rs in groups.items() for r in rs
    ]
    numbers = sorted((t, float(value)) for t, value in points if isinstance(value, int | float | np.number))
    t, y = np.array(numbers, dtype=float).reshape(-1, 2).T
    return t, y


def _draw(plot: Plot, verdict: Verdict) -> None:
    assert verdict.comparison is not None  # noqa: S101 - narrows: only what was compared is drawn
    first = verdict.comparison.divergences[0]
    upper, middle, lower = stacked(plot, 3)
    expected = field_series(verdict.golden, first.topic, first.field)
    found = field_series(verdict.played, first.topic, first.field)
    line(upper, *expected, label="expected")
    line(upper, *found, label="found", linestyle=":")
    upper.set_title(f"{first.topic}.{first.field}".rstrip("."))
    upper.legend(fontsize=8)
    t, one, other = np.intersect1d(expected[0], found[0], return_indices=True)
    line(middle, t, found[1][other] - expected[1][one])
    middle.set_title("found - expected")
    _draw_counts(lower, verdict.comparison.divergences)
    for axes in (upper, middle, lower):
        axes.axvline(first.stamp_ns * S_PER_NS, **FIRST)


def _draw_counts(axes: Any, divergences: Sequence[Divergence]) -> None:
    """Draw how many messages of every topic have diverged so far."""
    for topic in dict.fromkeys(item.topic for item in divergences):
        stamps = np.array([item.stamp_ns * S_PER_NS for item in divergences if item.topic == topic])
        axes.step(stamps, np.arange(1, stamps.size + 1), where="post", label=topic, marker=".", markersize=2)
    axes.set_title("messages that differ, so far")
    axes.legend(fontsize=8)


def _value(msg: Any, field: str) -> Any:
    """Return a field of a decoded message; None where it has none."""
    value = msg
    for name in field.replace("[", ".[").split("."):
        try:
            value = value[int(name[1:-1])] if name.startswith("[") else getattr(value, name)
        except (AttributeError, LookupError):
            return None
    return value
