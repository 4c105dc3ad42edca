"""Tracks of a chart that are one mode, found now by one and now by the other.

A heavily damped mode scatters by more from order to order than a track allows, so that two tracks take turns.
Two modes show side by side at the same orders; two tracks of one mode hardly ever do. They are joined where
their poles are nearer than half of their decay and their shapes are the same. Of light damping they are not:
its tracks do not break, and noise has short ones of it everywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from flexarm_model.identification.lscf import OrderPoles
from flexarm_model.identification.stabilisation import LASTING, Track, likeness, tracks

HEAVY = 0.05  # damping ratio from which an order moves a frequency by more than a track allows [1]
TURNS = 0.25  # share of the orders of the shorter track at which both may show
NEAR = 0.5  # distance of the poles over the smaller decay
ALIKE = 0.9  # assurance criterion from which shapes are the same [1]


class _Settled(NamedTuple):
    """A track and its pole, which is a median of many: it is asked for once per pair."""

    track: Track
    pole: complex


def lasting_modes(chart: Sequence[OrderPoles]) -> tuple[Track, ...]:
    """Return the modes that last for the share of the orders, slowest first."""
    whole = list[_Settled]()
    for track in sorted(tracks(chart), key=lambda track: len(track.orders), reverse=True):
        settled = _Settled(track, track.pole)
        home = next((i for i, other in enumerate(whole) if _is_same(other, settled)), None)
        if home is None:
            whole.append(settled)
        else:
            joined = _together(whole[home].track, track)
            whole[home] = _Settled(joined, joined.pole)
    lasting = (each for each in whole if len(each.track.orders) >= LASTING * len(chart))
    return tuple(track for track, _ in sorted(lasting, key=lambda each: abs(each.pole)))


def _is_same(a: _Settled, b: _Settled) -> bool:
    if min(-a.pole.real / abs(a.pole), -b.pole.real / abs(b.pole)) < HEAVY:
        return False
    if abs(a.pole - b.pole) >= NEAR * min(-a.pole.real, -b.pole.real):
        return False
    common = len(set(a.track.orders) & set(b.track.orders))
    if common > TURNS * min(len(a.track.orders), len(b.track.orders)):
        return False
    return likeness(a.track.participation, b.track.participation) > ALIKE


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
