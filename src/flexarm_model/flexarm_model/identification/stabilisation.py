"""Which poles come back at every order: tracks through a stabilisation chart, and the choice among them.

A pole continues a track when frequency and damping have hardly changed since the order before. Poles are
assigned to tracks together, by their participations too, so that two modes under one frequency stay two
tracks; of an exact pair the participations may turn from order to order, so they decide, but refuse nothing.
A structure's mode is a track that has lasted for a good share of the orders.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy
from numpy.typing import NDArray

from flexarm_model.identification.lscf import OrderPoles

Complex = NDArray[np.complex128]
SAME_FREQUENCY = 0.01  # relative change from one order to the next [1]
SAME_DAMPING = 0.3  # the same of the damping ratio [1]
LASTING = 0.4  # share of the orders through which a mode lasts [1]
REFUSED = 1e6  # cost of a pair that cannot be the same mode


@dataclass
class Track:
    """A pole through the orders.

    Attributes:
        orders: Orders at which it was found, ascending.
        poles: Its value there [rad/s].
        participations: Its participation of the inputs there, (n_in,) each.
    """

    orders: list[int] = field(default_factory=list)
    poles: list[complex] = field(default_factory=list)
    participations: list[Complex] = field(default_factory=list)

    @property
    def pole(self) -> complex:
        """Median over the upper half of its orders [rad/s]."""
        upper = np.array(self.poles[len(self.poles) // 2 :])
        return complex(np.median(upper.real), np.median(upper.imag))

    @property
    def participation(self) -> Complex:
        """Participation at its highest order, where those of all modes belong together, (n_in,)."""
        return self.participations[-1]


def tracks(chart: Sequence[OrderPoles]) -> tuple[Track, ...]:
    """Return every track of a chart, slowest first; a pole that continues none begins one."""
    found = list[Track]()
    for at_order in chart:
        cost = np.array([[_cost(track, at_order, i) for i in range(at_order.poles.size)]
                         for track in found]).reshape(len(found), at_order.poles.size)  # fmt: skip
        rows, columns = scipy.optimize.linear_sum_assignment(cost)
        owner = {int(c): found[r] for r, c in zip(rows, columns, strict=True) if cost[r, c] < REFUSED}
        for i in range(at_order.poles.size):
            track = owner.get(i)
            if track is None:
                track = Track()
                found.append(track)
            track.orders.append(at_order.order)
            track.poles.append(complex(at_order.poles[i]))
            track.participations.append(at_order.participation[i])
    return tuple(sorted(found, key=lambda track: abs(track.pole)))


def lasting(chart: Sequence[OrderPoles]) -> tuple[Track, ...]:
    """Return the tracks that last for the share of the orders, slowest first."""
    return tuple(track for track in tracks(chart) if len(track.orders) >= LASTING * len(chart))


def likeness(p: Complex, q: Complex) -> float:
    """Return the assurance criterion of two participations [1]."""
    return float(abs(np.vdot(p, q)) ** 2 / (np.vdot(p, p).real * np.vdot(q, q).real))


def _cost(track: Track, at_order: OrderPoles, i: int) -> float:
    before, now = track.poles[-1], complex(at_order.poles[i])
    frequency = abs(abs(now) / abs(before) - 1) / SAME_FREQUENCY
    damping = abs((now.real / abs(now)) / (before.real / abs(before)) - 1) / SAME_DAMPING
    if max(frequency, damping) > 1:
        return REFUSED
    unlike = 1 - likeness(track.participations[-1], at_order.participation[i])
    return float(frequency**2 + damping**2 + unlike)
