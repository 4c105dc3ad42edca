"""Trajectory of the actuated axes: samples, a cubic between them, ends held."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flexarm_model.modal.read_only import lock_arrays

if TYPE_CHECKING:
    from typing import Self  # Python 3.10 has none

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Trajectory:
    """Samples of a motion; between them a cubic, before and after them its ends at rest.

    Attributes:
        t: Increasing instants [s], (k,).
        theta: Position [rad] or [m], (k, n_theta).
        theta_dot: Velocity [rad/s] or [m/s], (k, n_theta).
        theta_ddot: Acceleration [rad/s^2] or [m/s^2], (k, n_theta).
        theta_ddot_before: Acceleration just before every instant, where it jumps there, (k, n_theta); None:
            it never jumps.
    """

    t: Array
    theta: Array
    theta_dot: Array
    theta_ddot: Array
    theta_ddot_before: Array | None = None

    @classmethod
    def through(cls, t: ArrayLike, theta: ArrayLike, theta_dot: ArrayLike | None = None) -> Self:
        """Return the motion through points whose accelerations are those of its cubics.

        Args:
            t: Increasing instants [s], (k,).
            theta: Position [rad] or [m], (k, n_theta).
            theta_dot: Velocity [rad/s] or [m/s], (k, n_theta); None: that of the spline of continuous
                acceleration with both ends at rest.

        Raises:
            ValueError: A shape does not fit or time does not increase; the message says which.
        """
        t, theta = _as_array("t", t), _as_array("theta", theta)
        still = np.zeros_like(theta)
        motion = cls(t, theta, still if theta_dot is None else _as_array("theta_dot", theta_dot), still)
        if theta_dot is None and t.size > 2:  # two points are a cubic from rest to rest as it is
            from scipy.interpolate import CubicSpline  # for few references, of the many who import this

            between = CubicSpline(t, theta, bc_type="clamped")(t[1:-1], 1)
            motion = replace(motion, theta_dot=np.vstack([still[:1], between, still[:1]]))
        _, _, c2, c3, _, _, h = motion._cubics.swapaxes(0, 1)
        begins, ends = 2 * c2 / h**2, (2 * c2 + 6 * c3) / h**2
        return replace(
            motion,
            theta_ddot=np.vstack([begins, still[:1]]),
            theta_ddot_before=np.vstack([still[:1], ends]),
        )

    def __post_init__(self) -> None:
        """Check the shapes and make the arrays read-only; the caller's own are copied, lists become arrays.

        Raises:
            ValueError: A shape does not fit, time does not increase, or a value is no finite number; the
                message says which.
        """
        arrays = {name: _as_array(name, value) for name, value in vars(self).items() if value is not None}
        for name, array in arrays.items():
            object.__setattr__(self, name, array)
        lock_arrays(self)
        self._check_shapes()
        for array in arrays.values():
            if not np.isfinite(array).all():
                raise ValueError("reference: a value is not finite")
        if self.t.size < 1 or (np.diff(self.t) <= 0).any():
            raise ValueError("reference: time does not increase")

    def _check_shapes(self) -> None:
        if self.t.ndim != 1:
            raise ValueError(f"reference: t has shape {self.t.shape}; expected (k,)")
        k, columns = self.t.size, self.theta.shape[1] if self.theta.ndim == 2 else "n_theta"
        for name in ("theta", "theta_dot", "theta_ddot", "theta_ddot_before"):
            array = getattr(self, name)
            if array is not None and array.shape != (k, columns):
                raise ValueError(f"reference: {name} has shape {array.shape}; expected ({k}, {columns})")

    def sample(self, times: Array) -> tuple[Array, Array, Array]:
        """Return position, velocity and acceleration at ``times`` [s], each (len(times), n_theta)."""
        n, stacked = self.theta.shape[1], self.stacked(times)
        return stacked[:, :n], stacked[:, n : 2 * n], stacked[:, 2 * n :]

    def before(self, times: Array) -> Array:
        """Return the acceleration just before ``times`` [s] where it may jump, (len(times), n_theta)."""
        side: Literal["left", "right"] = "right" if self.theta_ddot_before is None else "left"
        return self.stacked(times, side)[:, 2 * self.theta.shape[1] :]

    def stacked(self, times: Array, side: Literal["left", "right"] = "right") -> Array:
        """Return what ``sample`` does side by side, (len(times), 3 n_theta); from which side, at a jump."""
        times = np.asarray(times, float)
        i, (starts, lengths, pieces) = self.t.searchsorted(times, side=side), self._pieces
        s = np.minimum(np.maximum((times - starts[i]) / lengths[i], 0.0), 1.0)[:, None]
        c0, c1, c2, c3 = pieces[:, i]
        return np.asarray(c0 + s * (c1 + s * (c2 + s * c3)))

    def position(self, t: float) -> Array:
        """Return the position at ``t`` [s], (n_theta,); the same as ``sample`` gives, sooner."""
        i, (starts, lengths, pieces) = bisect_right(self._instants, t), self._pieces
        s = min(max((t - starts.item(i)) / lengths.item(i), 0.0), 1.0)
        cubics = zip(*pieces[:, i, : self.theta.shape[1]].tolist(), strict=True)
        return np.array([a + s * (b + s * (c + s * d)) for a, b, c, d in cubics])  # of so few, soonest so

    @cached_property
    def _instants(self) -> list[float]:
        instants: list[float] = self.t.tolist()
        return instants

    @cached_property
    def _pieces(self) -> tuple[Array, Array, Array]:
        """Begin [s] and length [s] of the time before, of every interval, and of the time after, (k + 1,).

        With them go the coefficients of ``[theta theta' theta'']`` in the share of the length that is over,
        lowest power first, (4, k + 1, 3 n_theta).
        """
        p0, v0, c2, c3, a0, a1, h = self._cubics.swapaxes(0, 1)
        n, pieces = self.theta.shape[1], np.zeros((4, self.t.size + 1, 3 * self.theta.shape[1]))
        theta, theta_dot, theta_ddot = pieces[..., :n], pieces[..., n : 2 * n], pieces[..., 2 * n :]
        theta[0, 0], theta[0, -1] = self.theta[0], self.theta[-1]
        theta[:, 1:-1] = p0, v0, c2, c3
        theta_dot[:3, 1:-1] = v0 / h, 2 * c2 / h, 3 * c3 / h
        theta_ddot[:2, 1:-1] = a0, a1 - a0
        return np.r_[self.t[0], self.t], np.r_[1.0, np.diff(self.t), 1.0], pieces

    @cached_property
    def _cubics(self) -> Array:
        """Coefficients of every interval, its accelerations and its length, (k - 1, 7, n_theta)."""
        h = np.broadcast_to(np.diff(self.t)[:, None], self.theta[1:].shape)
        v0, v1, step = self.theta_dot[:-1] * h, self.theta_dot[1:] * h, np.diff(self.theta, axis=0)
        c2, c3 = 3 * step - 2 * v0 - v1, -2 * step + v0 + v1
        ends = self.theta_ddot if self.theta_ddot_before is None else self.theta_ddot_before
        parts = [self.theta[:-1], v0, c2, c3, self.theta_ddot[:-1], ends[1:], h]
        return np.stack(parts, axis=1)


def _as_array(name: str, values: ArrayLike) -> Array:
    try:
        return np.asarray(values, float)
    except (TypeError, ValueError):  # NumPy does not say of what
        shape = "(k,)" if name == "t" else "(k, n_theta)"
        raise ValueError(f"reference: {name} is no array of numbers; expected {shape}") from None
