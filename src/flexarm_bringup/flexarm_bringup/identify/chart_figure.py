"""The stabilisation chart: poles of every order, those that last coloured."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.page.figures import Figure, drawing, to_figure
from flexarm_model.identification.lscf import OrderPoles
from flexarm_model.identification.stabilisation import tracks

Array = NDArray[np.float64]
LASTING = 0.4  # share of the orders


def chart_figure(chart: Sequence[OrderPoles], found_hz: Array) -> Figure:
    """Return the chart.

    Args:
        chart: Poles of every order.
        found_hz: Modes that were kept [Hz].
    """
    every = tracks(chart)
    with drawing(9.0, 3.8) as plot:
        axes = plot.subplots()
        for f in found_hz:
            axes.axvline(f, color="#8a7d2f", linewidth=0.8)
        for wanted, colour, size, label in (
            (False, "#9aa4b0", 3, "comes and goes"),
            (True, "#d9772b", 5, "lasts"),
        ):
            chosen = [t for t in every if (len(t.orders) >= LASTING * len(chart)) == wanted]
            f_hz = np.array([abs(pole) for t in chosen for pole in t.poles]) / (2 * np.pi)
            orders = [order for t in chosen for order in t.orders]
            axes.plot(f_hz, orders, ".", color=colour, markersize=size, label=label)
        axes.set(xlabel="frequency [Hz]", ylabel="order")
        axes.legend(loc="upper left", bbox_to_anchor=(0.0, 1.14), ncols=2)
        caption = (
            "Stabilisation chart: stable poles of every order; a structure's pole comes back with the same "
            "frequency and damping. Lines: modes that were kept."
        )
        return to_figure(plot, caption)
