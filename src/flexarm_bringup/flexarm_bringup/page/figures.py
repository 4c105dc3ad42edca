"""Plots for a page: inline SVG whose text takes the page's colour, so they read on light and dark."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Plot

INK = "#010203"  # stands for the page's text colour until the SVG is written
COLOURS = ("#3b82c4", "#d9772b", "#2f9e77", "#b0568f", "#8a7d2f", "#7d6bd0")  # readable on white and on black
STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",  # text stays text
    "font.size": 10.0,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "grid.color": INK,
    "grid.alpha": 0.15,
    "axes.grid": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.titlesize": 10.0,
    "axes.titlelocation": "left",
    "figure.facecolor": "none",
    "axes.facecolor": "none",
    "legend.frameon": False,
    "lines.linewidth": 1.6,
    "figure.constrained_layout.use": True,
}


@dataclass(frozen=True)
class Figure:
    """A drawing and the sentence below it."""

    caption: str
    svg: str


@contextmanager
def drawing(width: float = 9.0, height: float = 3.6) -> Iterator[Plot]:
    """Give an empty matplotlib figure of that size [inch] in the page's style, without any display."""
    import matplotlib
    from cycler import cycler
    from matplotlib.figure import Figure as Plot

    with matplotlib.rc_context({**STYLE, "axes.prop_cycle": cycler(color=COLOURS)}):
        yield Plot(figsize=(width, height))


def to_figure(plot: Plot, caption: str) -> Figure:
    """Return the plot as SVG that scales with the page and whose ids are its own.

    Args:
        plot: A matplotlib figure, still inside ``drawing``.
        caption: One sentence; also the text for those who cannot see it.
    """
    import matplotlib

    buffer = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": caption}):  # same plot, same bytes; other plot, other ids
        plot.savefig(buffer, format="svg", metadata={"Date": None})
    svg = buffer.getvalue()
    svg = svg[svg.index("<svg") :].replace(INK, "currentColor")
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    meant = set(re.findall(r'(?:url\(|href=")#([^")]+)', svg))
    svg = re.sub(r' id="([^"]*)"', lambda found: found[0] if found[1] in meant else "", svg)
    svg = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", svg, count=1)
    svg = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", svg, count=1)
    return Figure(caption, svg.strip())


def standalone(figure: Figure) -> str:
    """Return the drawing as an SVG file of its own, dark on white."""
    svg = figure.svg.replace("currentColor", "#222222")
    return svg.replace("<svg", '<svg style="background:#ffffff"', 1) + "\n"
