"""Modes whose frequency is known to their bandwidth, from all uncertainty there is.

One sigma is the root of the sum of two squares: the larger of the fit's curvature and the scatter over blocks
drawn again, and the scatter over methods. A frequency that is not known to the bandwidth (or to a line, where
that is wider) is that of no resonance: such a mode is left out, the most uncertain first, and the others are
fitted again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_model.identification.automatic import Identified, without_mode
from flexarm_model.identification.bootstrap import Scatter
from flexarm_model.identification.method_scatter import method_scatter
from flexarm_model.modal.fit import FitOptions, PoleFit
from flexarm_model.modal.frf import Frf

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Unsure:
    """A mode that was left out, since its frequency is not known to its bandwidth.

    Attributes:
        f_hz: Its frequency [Hz].
        f_std_hz: One sigma of it, all together [Hz].
        bandwidth_hz: Its bandwidth, or the distance of the lines where that is larger [Hz].
    """

    f_hz: float
    f_std_hz: float
    bandwidth_hz: float


@dataclass(frozen=True)
class Held:
    """Modes, and how well they are known.

    Attributes:
        found: The modes.
        scatter: Over blocks drawn again; None without blocks or modes.
        methods: Over methods; None without modes.
        unsure: What was left out.
    """

    found: Identified
    scatter: Scatter | None
    methods: Scatter | None
    unsure: tuple[Unsure, ...] = ()


def held_modes(
    frf: Frf,
    found: Identified,
    options: FitOptions,
    lobe_lines: float,
    drawn_again: Callable[[PoleFit], Scatter | None],
) -> Held:
    """Return the modes whose frequency is known to their bandwidth.

    Args:
        frf: Responses that were fitted.
        found: Modes of them.
        options: With which they were fitted.
        lobe_lines: See ``identify_modes``.
        drawn_again: Returns the scatter of a fit over blocks drawn again; None where there are none.
    """
    spacing, unsure = float(frf.f_hz[1] - frf.f_hz[0]), list[Unsure]()
    while found.fit is not None:
        fit = found.fit
        scatter, methods = drawn_again(fit), method_scatter(frf, found, options)
        f_std_hz = all_together(fit, scatter, methods).f_std_hz
        bandwidth = np.maximum(2 * fit.model.zeta * fit.model.f_hz, spacing)
        worst = int((f_std_hz / bandwidth).argmax())
        if f_std_hz[worst] <= bandwidth[worst]:
            return Held(found, scatter, methods, tuple(unsure))
        unsure.append(Unsure(float(fit.model.f_hz[worst]), float(f_std_hz[worst]), float(bandwidth[worst])))
        found = without_mode(frf, found, worst, options, lobe_lines)
    return Held(found, None, None, tuple(unsure))


def all_together(fit: PoleFit, scatter: Scatter | None, methods: Scatter | None) -> Scatter:
    """Return one sigma from all there is."""

    def of(name: str) -> Array:
        """Return that of frequencies or dampings, (r,)."""
        noise = [np.nan_to_num(getattr(fit, name))] + ([getattr(scatter, name)] if scatter else [])
        other = np.nan_to_num(getattr(methods, name)) if methods else 0.0
        return np.asarray(np.hypot(np.max(noise, axis=0), other))

    return Scatter(of("f_std_hz"), of("zeta_std"))
