"""From the state that was measured to the one in which the first torque acts that can still be chosen.

A torque acts ``delay_periods`` control periods and a ``latency`` after the instant of the state it was
computed from, and then for one period. With ``latency`` a whole number of periods and a share ``f`` of one,
the torque that acts now was sent one period before the whole ones, and goes on acting for ``f dt``::

    x <- A(f dt) x + B(f dt) (u + d) + c(f dt)           the hold that is split, if f > 0
    x <- A(dt) x + B(dt) (u + d) + c(dt)                 for every other torque on its way

which is exact for any delay. A torque never acts in the period of its own state, so that ``delay_periods`` 0
counts as 1. The program's grid begins where the first chosen torque does. All of it together is one affine
map of what is measured.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.program.penalties import Known
from flexarm_controller.program.prediction import plant
from flexarm_controller.settings import MpcConfig
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.state_space import StateSpace

Array = NDArray[np.float64]
WHOLE = 1e-6  # of a period; a share below it is none


def split_delay(config: MpcConfig, dt: float) -> tuple[int, float]:
    """Return the delay as whole periods, at least one, and the share of one that is left [1], in [0, 1)."""
    periods = config.latency / dt
    whole = int(np.floor(periods + WHOLE))
    share = periods - whole
    return max(config.delay_periods, 1) + whole, share if share > WHOLE else 0.0


def torques_kept(config: MpcConfig, dt: float) -> int:
    """Return how many of the torques sent a law needs: those on their way."""
    whole, share = split_delay(config, dt)
    return whole + (share > 0.0)


def in_whole_periods(config: MpcConfig, dt: float) -> MpcConfig:
    """Return settings with as many ``torques_kept``, all for a whole period: a delay up to one longer."""
    whole, share = split_delay(config, dt)
    own = max(config.delay_periods, 1)
    if not share:
        return config
    return replace(config, delay_periods=own + 1, latency=(whole - own) * dt)


class Delay:
    """The constant delay of one model's loop.

    Attributes:
        lead: From the instant of a state to that of the first torque that can be chosen [s].
    """

    def __init__(self, model: ReducedModel, system: StateSpace, config: MpcConfig, dt: float) -> None:
        """Prepare the holds.

        Args:
            model: The served model.
            system: What it does in a control period.
            config: Delay and latency.
            dt: Control period [s].
        """
        whole, share = split_delay(config, dt)
        first = [plant(model, share * dt)] if share else []
        self._holds = [*first, *[system] * whole]
        self.lead = (whole + share) * dt

    def advance(self, x: Array, d: Array, sent: Array) -> Array:
        """Return the state in which the first chosen torque acts, (n_x,).

        Args:
            x: State [theta; eta; theta'; eta'], (n_x,).
            d: Unmodelled torque, (n_u,).
            sent: Torques that act from the state's instant on, oldest first, (``torques_kept``, n_u).
        """
        for s, torque in zip(self._holds, sent, strict=False):
            x = s.A.dot(x) + s.B.dot(torque + d) + s.c
        return x

    def map(self, known: Known, kept: int) -> tuple[Array, Array]:
        """Return (E, e) with ``p_now = E seen + e``, ``seen = [x; d; sent torques; sag]``; see ``penalties``.

        Args:
            known: Where the parts of p_now are.
            kept: Torques sent, oldest first, of which the last is the one before the first chosen.
        """
        n_x, n_u, n_eta = known.n_x, known.n_u, known.s.stop - known.s.start
        sent = n_x + n_u
        sag = sent + kept * n_u
        E, e = np.zeros((known.now.stop, sag + n_eta)), np.zeros(known.now.stop)
        x, c = E[known.x], e[known.x]  # views
        x[:, :n_x] = np.eye(n_x)
        x[n_u : n_x // 2, sag:] = -np.eye(n_eta)  # vibration is counted from where the arm rests
        for i, s in enumerate(self._holds):
            x[:], c[:] = s.A @ x, s.A @ c + s.c
            x[:, n_x:sent] += s.B
            x[:, sent + i * n_u : sent + (i + 1) * n_u] += s.B
        E[known.d, n_x:sent] = np.eye(n_u)
        E[known.u_before, sag - n_u : sag] = np.eye(n_u)
        E[known.s, sag:] = np.eye(n_eta)
        return E, e
