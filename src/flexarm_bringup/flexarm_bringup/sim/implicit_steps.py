"""Linearly implicit midpoint steps: stiff arms and arms with loops.

Bearings and axial modes ring at kilohertz; an explicit scheme would follow them. Here springs and
dampers are taken at the midpoint and everything else at the predicted one ``q* = q + h v / 2``, so
one linear system gives the change of velocity, loops included [Hairer2006]::

    [M* + h^2/4 K + h/2 D   G*'] [dv  ]   [ h (f - bias(q*, v)) ]
    [G*                     0  ] [h lm] = [ -2 G* v             ]      q+ = q + h (v + dv / 2)

The terms of velocity (gyroscopic, centrifugal) are taken at the old velocity to begin with: of first order,
which fast motion shows, and any motion of a loop. So a step is looked at twice, the second time with q* and
velocity in the middle of where the first look led: of second order. Where loops close all is made anew. An
open arm takes inertia and bias anew and keeps the factors of the matrix, and does so from ``FAST`` on. An
undamped arm of two links at 3 and 9 rad/s is off by 3e-6 of its energy within a second, by a quarter of that
with half the step (``./flexarm test src/flexarm_bringup/test/test_plant_energy.py -s -k turns_fast``).
Stable for every frequency, and without numerical damping of linear modes (they only get slower by
(w h)^2/12). After each period the dependent coordinates are moved onto the loops.

Friction is taken so that it never pushes an axis, however large it is and however fast the axis turns round;
see ``friction``.

A spring with play is in its gap or in contact throughout a step, as it is at q*; see ``backlash``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.sim.implicit_period import Stepping, make_period
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]


class ImplicitSteps:
    """Integrator of any tree."""

    def __init__(self, tree: ReducedTree, dt: float, substeps: int, friction: float) -> None:
        """Prepare both ways to move.

        Args:
            tree: The arm.
            dt: Control period [s].
            substeps: Steps per period.
            friction: Coulomb friction of the actuated axes [N m or N].
        """
        self.substeps, h, passes = substeps, dt / substeps, 2 if tree.n_c else 1
        self._driven, self._led = (
            make_period(tree, Stepping(h, substeps, friction, is_driven, passes))
            for is_driven in (True, False)
        )

    def follow(self, tree: ReducedTree) -> None:
        """See Steps."""
        for period in (self._driven, self._led):
            period.follow(tree)

    def drive(self, q: Array, v: Array, tau: Array) -> tuple[Array, Array, Array]:
        """Return q, v and the acceleration after one period under torques (n_theta,)."""
        return self._driven.advance(q, v, tau)

    def servo(self, q: Array, v: Array, acceleration: Array) -> tuple[Array, Array, Array]:
        """The same with the actuated axes accelerated as prescribed, (n_theta,)."""
        return self._led.advance(q, v, acceleration)
