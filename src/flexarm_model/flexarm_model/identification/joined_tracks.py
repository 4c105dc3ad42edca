"""Tracks of a chart that are one mode, found now by one and now by the other.

A heavily damped mode scatters by more from order to order than a track allows, so that two tracks take turns.
Two modes show side by side at the same orders; two tracks of one mode hardly ever do. They are joined where
their poles are nearer than half of their decay and their shapes are the same. Of light damping they are not:
its tracks do not break, and noise has short ones of it everywhere.
"""

from __future__ import annotations

from collections.abc import Sequence

from flexarm_model.identification.lscf import OrderPoles
from flexarm_model.identification.stabilisation import LASTING, Track, likeness, tracks

HEAVY = 0.05  # damping ratio from which an order moves a frequency by more than a track allows [1]
TURNS = 0.25  # share of the orders of the shorter track at which both may show
NEAR = 0.5  # distance of the poles over the smaller decay
ALIKE = 0.9  # assurance criterion from which shapes are the same [1]


def lasting_modes(chart: Sequence[OrderPoles]) -> tuple[Track, ...]:
    """Return the modes that last for the share of the orders, slowest first."""
    whole = list[Track]()
    for track in sorted(tracks(chart), key=lambda track: len(track.orders), reverse=True):
        home = next((i for i, other in enumerate(whole) if _is_same(other, track)), None)
        if home is None:
            whole.append(track)
        else:
            whole[home] = _together(whole[home], track)
    lasting = (track for track in whole if len(track.orders) >= LASTING * len(chart))
    return tuple(sorted(lasting, key=lambda track: abs(track.pole)))


def _is_same(a: Track, b: Track) -> bool:
    common = len(set(a.orders) & set(b.orders))
    if common > TURNS * min(len(a.orders), len(b.orders)):
        return False
    if min(-a.pole.real / abs(a.pole), -b.pole.real / abs(b.pole)) < HEAVY:
        return False
    is_near = abs(a.pole - b.pole) < NEAR * min(-a.pole.real, -b.pole.real)
    return is_near and likeness(a.participation, b.participation) > ALIKE


def _together(longer: Track, other: Track) -> Track:
    """Return one track of both; at an order that both have, what the longer one has."""
    at = {order: (other, i) for i, order in enumerate(other.orders)}
    at |= {order: (longer, i) for i, order in enumerate(longer.orders)}
    kept = [at[order] for order in sorted(at)]
    return Track(
        sorted(at),
        [track.poles[i] for track, i in kept],
        [track.participations[i] for track, i in kept],
    )
