"""How far an arm is known to bend: what a mode seems to do may as well be chance.

A run of the filter starts broadly. Where no gauge narrows it, what a mode seems to do is mostly noise, and so
is what would follow from it for the motion (centrifugal forces, changed inertia; many times the real ones):
the run then fits nothing, and leaving out some sound sensor seems to cure it. Every displacement and velocity
``x`` of variance ``P`` counts for the share ``x^2 / (x^2 + 9 P)``, half at three sigma.
"""

from __future__ import annotations

from flexarm_estimator.filter import Belief
from flexarm_estimator.state.state_layout import StateLayout

_HALF = 3.0  # sigma
_TINY = 1e-300  # keeps 0 / 0 away


def known_modes(belief: Belief, layout: StateLayout) -> Belief:
    """Return the belief with displacement and velocity of every mode as far as they are known."""
    x, P = belief.x.copy(), belief.P.diagonal()
    for part in (layout.eta, layout.eta_dot):
        square = x[part] ** 2
        x[part] *= square / (square + _HALF**2 * P[part] + _TINY)
    return Belief(x, belief.P)
