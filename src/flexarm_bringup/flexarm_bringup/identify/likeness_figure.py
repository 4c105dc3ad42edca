"""Modal assurance between the modes found: which shapes the sensors cannot tell apart."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.page.figures import Figure, drawing, to_figure
from flexarm_model.modal.mac import auto_mac

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]
SIZE, LEAST = 0.42, 2.4  # of a mode and of the figure at least [inch]


def likeness_figure(f_hz: Array, shapes: Complex) -> Figure:
    """Return the matrix of assurance criteria.

    Args:
        f_hz: Frequencies [Hz], (r,).
        shapes: At the sensors, (r, n_out), each unit by its own size.
    """
    even = shapes / np.maximum(abs(shapes).max(axis=0), np.finfo(float).tiny)
    matrix = auto_mac(even.T)
    side = max(LEAST, SIZE * f_hz.size + 1.0)
    with drawing(9.0, side) as plot:
        axes = plot.subplots()
        axes.grid(False)
        axes.pcolormesh(matrix[::-1], cmap="Blues", vmin=0.0, vmax=1.0)
        names = [f"{f:.2f}" for f in f_hz]
        ticks = np.arange(f_hz.size) + 0.5
        axes.set_xticks(ticks, names, rotation=45 if f_hz.size > 6 else 0)
        axes.set_yticks(ticks, names[::-1])
        axes.set(aspect="equal", xlabel="frequency [Hz]", ylabel="frequency [Hz]")
        for i in range(f_hz.size):
            for j in range(f_hz.size):
                dark = matrix[i, j] > 0.6
                axes.text(
                    j + 0.5, f_hz.size - i - 0.5, f"{matrix[i, j]:.2f}", ha="center", va="center",
                    fontsize=7, color="white" if dark else "#1c2430",
                )  # fmt: skip
        caption = (
            "Modal assurance criterion of the shapes found, sensors by their largest reading: near 1 beside "
            "the diagonal, the sensors cannot tell two modes apart."
        )
        return to_figure(plot, caption)
