"""A panel: the question it answers, the topics it needs, and how it is drawn."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.bag_plots.series import BagSeries, spells, thin
from flexarm_bringup.bag_plots.silence import gaps
from flexarm_bringup.bags.bag_writer import BagError

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Plot

Array = NDArray[np.float64]
LIMIT: dict[str, Any] = {"color": "#c0392b", "linewidth": 1.0, "linestyle": "--"}
NEAR = 0.5  # share of a limit from which on the limit is drawn
QUIET: dict[str, Any] = {"color": "#888888", "linewidth": 0.8, "linestyle": ":"}
PALETTE = ("#2f9e77", "#3b82c4", "#d9772b", "#b0568f", "#8a7d2f", "#7d6bd0", "#c0392b", "#888888")
KNOWN = {
    **dict.fromkeys(("ok", "armed", "mpc", "nmpc", "succeeded"), "#2f9e77"),
    **dict.fromkeys(("lqr", "pd", "executing", "degraded"), "#3b82c4"),
    **dict.fromkeys(("shifted plan", "accepted", "stale"), "#8a7d2f"),
    **dict.fromkeys(("damping", "canceled", "starting"), "#d9772b"),
    **dict.fromkeys(("braking", "aborted", "rejected", "faulty", "lost", "binds"), "#c0392b"),
    **dict.fromkeys(("hold", "off", "stopped", "inactive"), "#888888"),
    "free": "none",
}
TIME = "time [s]"


@dataclass(frozen=True)
class Panel:
    """One figure of the page.

    Attributes:
        name: Short, also of its file.
        title: What is asked, also the caption.
        topics: Relative topics without which there is no answer.
        uses: Topics that are drawn, too, where they are there.
        draw: Draws into an empty figure.
        height: Of the figure [inch].
    """

    name: str
    title: str
    topics: tuple[str, ...]
    draw: Callable[[Plot, BagSeries], None]
    uses: tuple[str, ...] = ()
    height: float = 3.6

    def missing(self, series: BagSeries) -> list[str]:
        """Return the topics that it needs and the bag lacks."""
        return [topic for topic in self.topics if not series.has(topic)]


def line(axes: Any, t: Array, y: Array, **style: Any) -> None:
    """Draw a line, thinned, and broken where the topic was silent."""
    shown_t, shown = thin(t, y)
    last = t[gaps(t)]
    at = np.searchsorted(shown_t, last, side="right")
    axes.plot(np.insert(shown_t, at, last), np.insert(np.asarray(shown, float), at, np.nan), **style)


def band(axes: Any, t: Array, low: Array, high: Array, **style: Any) -> None:
    """Fill between two lines, thinned; there is nothing where the topic was silent.

    Args:
        axes: Where to draw.
        t: Instants [s], (k,).
        low: The lower line, (k,).
        high: The upper line, (k,).
        style: As matplotlib's ``fill`` has it.
    """
    last, pieces = t[gaps(t)], []
    for line_t, y in (thin(t, low), thin(t, high)):
        at = np.searchsorted(line_t, last, side="right")
        pieces.append(list(zip(np.split(line_t, at), np.split(y, at), strict=True)))
    for (t_low, below), (t_high, above) in zip(*pieces, strict=True):
        axes.fill(np.append(t_low, t_high[::-1]), np.append(below, above[::-1]), **style)
        style.pop("label", None)  # once is enough for the legend


def reach(axes: Any, y: Array, limit: float) -> str:
    """Draw both sides of a limit that a signal came near; return in words how near, "" without a limit.

    Args:
        axes: Where the signal is drawn; far from its limit they stay scaled to it.
        y: The signal, (k,).
        limit: Of its absolute value; infinite for none.
    """
    if not np.isfinite(limit) or not np.isfinite(y).any():
        return ""
    share = float(np.nanmax(np.abs(y))) / limit
    for side in (-limit, limit) if share >= NEAR else ():
        axes.axhline(side, **LIMIT)
    return f"at most {100 * share:.3g} % of the limit" if share < 1.0 else "at the limit"


def strip(
    axes: Any, row: int, t: Array, names: Sequence[str], colours: dict[str, str], holds: bool = False
) -> None:
    """Draw a strip that has a colour for every name; new names get the next colour of the palette.

    Args:
        axes: Where to draw.
        row: Which strip from above.
        t: Instants of the messages [s], (k,).
        names: What they say, k.
        colours: By name; more come in.
        holds: Of messages that tell of changes only; else the strip is blank where the topic was silent.
    """
    for start, length, name in spells(t, names, holds):
        colour = colours.setdefault(name, KNOWN.get(name, PALETTE[len(colours) % len(PALETTE)]))
        axes.broken_barh([(start, length)], (row - 0.4, 0.8), facecolors=colour, linewidth=0)


def name_rows(axes: Any, rows: Sequence[str], colours: dict[str, str]) -> None:
    """Label the rows of strips and say what the colours mean."""
    axes.set(yticks=range(len(rows)), yticklabels=rows, ylim=(len(rows) - 0.5, -0.5))
    axes.grid(False)
    from matplotlib.patches import Patch

    shown = [Patch(color=colour, label=name) for name, colour in colours.items() if colour != "none"]
    axes.legend(handles=shown, fontsize=8, ncols=6, loc="lower left", bbox_to_anchor=(0.0, 1.0))


def stacked(plot: Plot, count: int) -> Any:
    """Return axes one above the other with one axis of time, (count,).

    Raises:
        BagError: There are none to be drawn.
    """
    if count < 1:
        raise BagError("its messages hold nothing to draw")
    panels = plot.subplots(count, 1, sharex=True, squeeze=False)[:, 0]
    panels[-1].set_xlabel(TIME)
    return panels
