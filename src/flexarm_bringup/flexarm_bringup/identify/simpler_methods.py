"""What simpler methods say of the same responses, to be printed beside."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.identify.measurement import Responses
from flexarm_model.identification.automatic import orders_for
from flexarm_model.identification.lscf import poles_of_orders
from flexarm_model.identification.stabilisation import lasting
from flexarm_model.modal.frf import KINDS, Frf
from flexarm_model.modal.half_power import HalfPower, LinesTooCoarseError, half_power

Array = NDArray[np.float64]


def half_power_beside(responses: Responses, frf: Frf, f_hz: float) -> HalfPower | str:
    """Return what half power reads from the response that stands out most at a frequency, or why not."""
    line = int(abs(frf.f_hz - f_hz).argmin())
    usual = np.median(abs(frf.H), axis=0)
    o, i = np.unravel_index((abs(frf.H[line]) / np.maximum(usual, 1e-300)).argmax(), frf.H.shape[1:])
    power = KINDS[responses.kinds.get(responses.outputs[int(o)], responses.kind)]
    receptance = abs(frf.H[:, o, i]) / abs(frf.s) ** power
    try:
        return half_power(frf.f_hz, receptance, f_hz)
    except LinesTooCoarseError:
        return "lines too coarse"
    except ValueError:
        return "no band"


def by_one_input(frf: Frf, weight: Array) -> tuple[float, ...]:
    """Return the frequencies that the first input alone gives through the chart [Hz], without refinement."""
    one = Frf(frf.f_hz, frf.H[:, :, :1], frf.kind)
    chart = poles_of_orders(one, orders_for(one), weight)
    return tuple(float(abs(track.pole)) / (2 * np.pi) for track in lasting(chart))
