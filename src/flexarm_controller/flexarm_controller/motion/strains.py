"""Strain of the limited gauges while the axes follow a trajectory exactly, vibration with it.

It is the strain of a motion without vibration, which is a cubic in time from sample to sample as the torque
is, and what accelerations make the modes of the served model ring. With ``p = -M_et theta''``, for each::

    eta'' + 2 zeta omega eta' + omega^2 eta = p        lambda = omega (-zeta + i sqrt(1 - zeta^2))
    eta = Im(w) / Im(lambda)        w' = lambda w + p        w = -p / lambda - p' / lambda^2 + v exp(lambda s)

From sample to sample p is a line in time, and v, which rings, is known once its jumps are. So an acceleration
that begins at once bends a strip up to twice as far as a steady one. Before the trajectory nothing rings;
jumps of velocity at its ends are left out. A law that damps the modes leaves the reference and stays below
that; one that does not, as joint PD, rings on in another phase than the reference would have it.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import accumulate

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.motion.cubics import extremes
from flexarm_controller.motion.torques import Torques
from flexarm_controller.motion.way import Way
from flexarm_controller.program.equilibrium import Equilibrium, build_equilibrium
from flexarm_model.motion.trajectory import Trajectory
from flexarm_model.served.reduced_model import ReducedModel

Array = NDArray[np.float64]
Poles = NDArray[np.complex128]
FINE = 16  # instants per period of the fastest mode: its peak is missed by 2 % of its share at most
MOST = 20_000  # instants looked at in one trajectory: some milliseconds
ALMOST_CRITICAL = 0.999  # damping of a mode that does not swing: from there on it rings no further


@dataclass(frozen=True)
class Strains:
    """See the module.

    Attributes:
        steady: Strain without vibration; of its rows the last are the gauges.
        names: Of the gauges, "gauge.channel", (n_gauges,).
        limit: Largest magnitude [1], (n_gauges,).
        push: ``M_et``, (n_eta, n_theta).
        poles: ``lambda`` of every mode [1/s], (n_eta,).
        per_ring: Strain per ``Im(w)``, (n_gauges, n_eta).
    """

    steady: Torques
    names: tuple[str, ...]
    limit: Array
    push: Array
    poles: Poles
    per_ring: Array

    def peaks(self, trajectory: Trajectory) -> tuple[Array, Array]:
        """Return instants [s] and strains [1] at them, (k, n_gauges) each.

        They are close together wherever the limit may be exceeded, until one period of the slowest mode
        after the end.
        """
        n, end = self.limit.size, self.steady.holding(trajectory.theta[-1:])[:, -self.limit.size :]
        if trajectory.t.size == 1:
            return np.tile(trajectory.t[:, None], n), end
        fine, parts = self.steady.cubics(trajectory)
        after = (end, *[np.zeros_like(end)] * 3)
        cubic = [np.vstack([part[:, -n:], rest]) for part, rest in zip(parts, after, strict=True)]
        h: Array = np.append(np.diff(fine.t), 2.0 * np.pi / abs(self.poles).min())
        v, lag = self._ringing(fine, h)
        index, share = self._looked_at(cubic, h, abs(v) @ abs(self.per_ring).T + abs(lag))
        c0, c1, c2, c3 = (part[index] for part in cubic)
        s, since = share[:, None], (share * h[index])[:, None]
        ring = (v[index] * np.exp(self.poles * since)).imag @ self.per_ring.T + lag[index]
        return np.tile(fine.t[index][:, None] + since, n), c0 + s * (c1 + s * (c2 + s * c3)) + ring

    def _ringing(self, trajectory: Trajectory, h: Array) -> tuple[Poles, Array]:
        """Return ``v`` at the begin of every interval, (k, n_eta), and what slopes take away, (k, n_gauges).

        The last interval of ``h`` [s], (k,), is that after the end.
        """
        ends = trajectory.before(trajectory.t[1:])
        rest = np.zeros_like(ends[:1])
        p0, p1 = (
            -np.vstack([part, rest]) @ self.push.T for part in (trajectory.theta_ddot[:-1], ends)
        )  # (k, n_eta)
        slope = (p1 - p0) / (h[:, None] * self.poles**2)
        begin, over, fades = (
            -p0 / self.poles - slope,
            -p1 / self.poles - slope,
            np.exp(np.outer(h, self.poles)),
        )
        jumps = -begin
        jumps[1:] += over[:-1]
        v = [_carried(*mode) for mode in zip(fades.T.tolist(), jumps.T.tolist(), strict=True)]
        return np.array(v).T, -slope.imag @ self.per_ring.T

    def _looked_at(self, cubic: list[Array], h: Array, most: Array) -> tuple[NDArray[np.intp], Array]:
        """Return intervals and shares of them: their begin, and more where the limit may be exceeded.

        Args:
            cubic: Strain without vibration, (k, n_gauges) each.
            h: Lengths of the intervals [s], (k,).
            most: What may come on top of it, (k, n_gauges).
        """
        is_near = (abs(extremes(cubic)[1]).max(axis=0) + most > self.limit).any(axis=1)
        per_second = FINE * abs(self.poles).max() / (2.0 * np.pi)
        allowed = max(MOST // max(int(is_near.sum()), 1), 1)
        count = np.where(is_near, np.clip(np.ceil(h * per_second), 1, allowed), 1).astype(int)
        index = np.repeat(np.arange(h.size), count)
        return index, (np.arange(index.size) - np.repeat(np.cumsum(count) - count, count)) / count[index]


def strains_of(model: ReducedModel, limits: Limits, way: Way | None = None) -> Strains | None:
    """Return the strains of an arm; None where no gauge has a limit.

    Args:
        model: The served model.
        limits: Of the arm.
        way: Of the trajectory, where loads change on it, with rows for motors and limited gauges.
    """
    X, x_0, limit, names = strain_rows(model, limits, build_equilibrium(model))
    if not names or not model.omega.size:
        return None
    n = model.n_theta
    zeta = np.minimum(model.zeta, ALMOST_CRITICAL)
    poles = model.omega * (-zeta + 1j * np.sqrt(1.0 - zeta**2))
    index = [model.outputs.names.index(name) for name in names]
    per_ring = model.outputs.C_pos[index, n:] / poles.imag
    steady = Equilibrium(np.zeros((0, X.shape[1])), np.zeros(0), X, x_0) if way is None else way
    return Strains(steady, tuple(names), limit, model.M[n:, :n], poles, per_ring)


def _carried(fades: list[complex], jumps: list[complex]) -> list[complex]:
    """Return what is there at every begin: what was there before, faded, and the jump, (k,) each."""
    steps = zip(fades, jumps[1:], strict=False)
    return list(accumulate(steps, lambda v, step: v * step[0] + step[1], initial=jumps[0]))


def strain_rows(
    model: ReducedModel, limits: Limits, equilibrium: Equilibrium
) -> tuple[Array, Array, Array, list[str]]:
    """Return strain per reference, at zero reference, its limits, and the names of the limited gauges."""
    out, finite = model.outputs, np.isfinite(limits.strain)
    names = [name for name, is_limited in zip(limits.gauges, finite, strict=True) if is_limited]
    index = [out.names.index(name) for name in names]
    C, y_0 = np.hstack([out.C_pos[index], out.C_vel[index]]), out.y0[index] - out.C_pos[index] @ model.xi0
    return C @ equilibrium.X, C @ equilibrium.x_0 + y_0, limits.strain[finite], names
