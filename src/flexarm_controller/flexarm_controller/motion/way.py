"""What an arm asks on a way of its axes: its loads at a few poses, and between them by their slopes.

Between two poses ``theta_i``, ``theta_i + d`` the load at rest is the cubic with the loads and slopes
``K_i d`` of both; beside the chord it goes on with the slopes between. A sine of the sum of all angles, the
worst that weight may be, errs by ``|d|^4 / 384`` of its largest value at most, with the sum ``|d|``: 4 % with
`SPACING`. Inertia, friction and what products of velocities take go in lines from pose to pose, and beside a
chord they are those on it: `close_poses` has poses so close that inertia is within 2 % of what it is there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.motion.pose_load import PoseLoad
from flexarm_model.motion.trajectory import Trajectory

Array = NDArray[np.float64]
SPACING = 2.0  # rad, of all axes together, from pose to pose at most
PIECE = 0.25  # rad, likewise, of what one cubic in time stands for
LOOKED = 8  # instants per interval by which its length is taken


@dataclass(frozen=True)
class _Place:
    """Where positions are: the pose before, (k,), and the share of the chord, (k, 1)."""

    index: NDArray[np.intp]
    share: Array


class Way:
    """Loads along poses.

    Attributes:
        poses: Of the axes, (m, n_theta), m >= 2.
        K, D, J: At the poses, (m, n_rows, n_theta).
    """

    def __init__(self, loads: Sequence[PoseLoad], size: Array) -> None:
        """Keep loads at one pose or more, in order; ``size`` (n_theta,) brings axes to angles [1, rad/m]."""
        self._loads, self._size = tuple(loads), size
        loads = loads if len(loads) > 1 else [*loads, *loads]
        parts = ("pose", "rest", "K", "D", "J", "turning", "bent")
        self.poses, self._rest, self.K, self.D, self.J, self._turning, self._bent = (
            np.array([getattr(load, part) for load in loads]) for part in parts
        )
        self._chords = np.diff(self.poses, axis=0)
        self._found: tuple[Array, _Place] | None = None

    def rows(self, weights: Array) -> Way:
        """Return the way with rows' inertia times ``weights``; rows after them are left out."""
        n = weights.size
        loads = [
            PoseLoad(
                at.pose, at.rest[:n], at.K[:n], at.D[:n], at.J[:n] * weights[:, None], at.turning[:n], at.bent
            )
            for at in self._loads
        ]
        return Way(loads, self._size)

    def is_near(self, theta: Array, near: float) -> bool:
        """Tell whether positions (k, n_theta) are beside a chord by no more than ``near`` [rad]."""
        place = self._place(theta)
        return bool((abs(theta - self._foot(place)) * self._size).max() <= near)

    def holding(self, theta: Array) -> Array:
        """Return what stands still at ``theta`` (k, n_theta), (k, n_rows)."""
        place = self._place(theta)
        i, s, d = place.index, place.share, self._chords[place.index]
        begin, end = self._rest[i], self._rest[i + 1]
        rises = _times(self.K[i], d), _times(self.K[i + 1], d)
        on = begin + s**2 * (3 - 2 * s) * (end - begin)
        on = on + s * (1 - s) * ((1 - s) * rises[0] - s * rises[1])
        return np.asarray(on + _times(self._between(self.K, place), theta - self._foot(place)))

    def slope(self, theta: Array, theta_dot: Array) -> Array:
        """Return how fast that changes, (k, n_rows)."""
        place = self._place(theta)
        i, s, d = place.index, place.share, self._chords[place.index]
        length = np.maximum(((d * self._size) ** 2).sum(axis=1, keepdims=True), np.finfo(float).tiny)
        rate = (theta_dot * d * self._size**2).sum(axis=1, keepdims=True) / length
        begin, end = _times(self.K[i], d), _times(self.K[i + 1], d)
        step = self._rest[i + 1] - self._rest[i]
        on = 6 * s * (1 - s) * step + (1 - s) * (1 - 3 * s) * begin + s * (3 * s - 2) * end
        return np.asarray(rate * on + _times(self._between(self.K, place), theta_dot - rate * d))

    def viscous(self, theta: Array, theta_dot: Array) -> Array:
        """Return what friction takes, (k, n_rows)."""
        return _times(self._between(self.D, self._place(theta)), theta_dot)

    def inertia(self, theta: Array, theta_ddot: Array) -> Array:
        """Return what accelerations take, (k, n_rows)."""
        return _times(self._between(self.J, self._place(theta)), theta_ddot)

    def turning(self, theta: Array, theta_dot: Array) -> Array:
        """Return what products of velocities take, (k, n_rows)."""
        return _times(self._between(self._turning, self._place(theta)), _products(theta_dot))

    def bending(self, rows: Array, theta: Array, theta_dot: Array, theta_ddot: Array) -> Array:
        """Return how far the arm is bent from rest, (k, r), by ``rows`` per coordinate of it, (r, n_q)."""
        motion = np.hstack([theta_dot, theta_ddot, _products(theta_dot)])
        return _times(self._between(rows @ self._bent, self._place(theta)), motion)

    def cubics(self, trajectory: Trajectory) -> tuple[Trajectory, tuple[Array, ...]]:
        """Return the same motion in pieces, and the torque of these as cubics, (k - 1, n_rows) each."""
        t, n = pieces(trajectory, self._size, PIECE), trajectory.theta.shape[1]
        theta, theta_dot, theta_ddot = (np.array(part) for part in trajectory.sample(t))
        _, until, braked = np.split(trajectory.stacked(t, "left"), (n, 2 * n), axis=1)
        theta_dot[-1] = until[-1]  # after its end it is at rest
        fine, h = Trajectory(t, theta, theta_dot, theta_ddot, braked), np.diff(t)[:, None]
        rest, turning = self.holding(theta), self.turning(theta, theta_dot)
        step, rise = np.diff(rest, axis=0), self.slope(theta, theta_dot)
        m0, m1 = rise[:-1] * h, rise[1:] * h
        _, v0, c2, c3, _, _, _ = fine._cubics.swapaxes(0, 1)
        c = [self.viscous(theta[:-1], part) for part in (v0 / h, 2 * c2 / h, 3 * c3 / h)]
        push = self.inertia(theta[:-1], theta_ddot[:-1]) + turning[:-1]
        line = self.inertia(theta[1:], braked[1:]) + turning[1:] - push
        return fine, (
            rest[:-1] + push + c[0], m0 + line + c[1], 3 * step - 2 * m0 - m1 + c[2], m0 + m1 - 2 * step
        )  # fmt: skip

    def _place(self, theta: Array) -> _Place:
        """Return the nearest points of the chords; the same are asked for several times in a row."""
        if self._found is not None and self._found[0] is theta:
            return self._found[1]
        d = self._chords * self._size
        length = np.maximum((d**2).sum(axis=1), np.finfo(float).tiny)
        off = (theta[:, None] - self.poses[:-1]) * self._size  # (k, m - 1, n)
        share = np.clip((off * d).sum(axis=2) / length, 0.0, 1.0)
        distance = ((off - share[..., None] * d) ** 2).sum(axis=2)
        index = distance.argmin(axis=1)
        place = _Place(index, share[np.arange(index.size), index][:, None])
        self._found = theta, place
        return place

    def _foot(self, place: _Place) -> Array:
        return np.asarray(self.poses[place.index] + place.share * self._chords[place.index])

    def _between(self, parts: Array, place: _Place) -> Array:
        """Return what is between its values at the poses, (k, ...)."""
        share = place.share.reshape(-1, *[1] * (parts.ndim - 1))
        return np.asarray((1 - share) * parts[place.index] + share * parts[place.index + 1])


def pieces(trajectory: Trajectory, size: Array, longest: float) -> Array:
    """Return instants, those of the samples among them, between which the axes go ``longest`` about [s]."""
    shares = np.arange(LOOKED + 1) / LOOKED
    t, h = trajectory.t[:-1], np.diff(trajectory.t)
    if not h.size:
        return trajectory.t
    theta = trajectory.sample((t[:, None] + h[:, None] * shares).ravel())[0].reshape(h.size, LOOKED + 1, -1)
    gone = (abs(np.diff(theta, axis=1)) * size).sum(axis=(1, 2))
    count = np.maximum(np.ceil(gone / longest), 1.0).astype(int)
    index = np.repeat(np.arange(h.size), count)
    part = np.arange(index.size) - np.repeat(np.cumsum(count) - count, count)
    return np.append(t[index] + h[index] * part / count[index], trajectory.t[-1])


def _products(theta_dot: Array) -> Array:
    """Return the products of two velocities, (k, n (n + 1) / 2), in the order of `turning_loads`."""
    first, second = np.triu_indices(theta_dot.shape[1])
    return np.asarray(theta_dot[:, first] * theta_dot[:, second])


def _times(matrices: Array, vectors: Array) -> Array:
    """Return the products of (k, r, n) and (k, n), (k, r)."""
    return np.asarray(np.einsum("krn,kn->kr", matrices, vectors))
