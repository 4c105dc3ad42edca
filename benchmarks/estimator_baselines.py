"""What the estimator's step is compared with: plain filterpy, plain NumPy, a finite-difference filter.

They do less: predict and update with textbook matrices, all rows at once, no gate, checks, health, tip or
correlation of noises, and as many periods again for every late frame. The finite-difference filter is the
extended one of public code: derivatives of the arm's step (scipy's Runge-Kutta, on our compiled dynamics) and
of the rows by differences, state by state.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from filterpy.kalman import KalmanFilter
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from flexarm_estimator.filters.flow import StateFlow

Array = NDArray[np.float64]
Action = Callable[[Any], object]
STEP = 1e-6  # of the finite differences


class Textbook(NamedTuple):
    """What the baselines know of the arm: one step, all rows at its end, the start."""

    A: Array
    B: Array
    Q: Array
    H: Array
    D: Array
    R: Array
    x: Array
    P: Array


def plain_filterpy(book: Textbook) -> Action:
    """Return filterpy as it is: predict, update."""
    kalman = KalmanFilter(dim_x=book.x.size, dim_z=book.R.shape[0], dim_u=book.B.shape[1])
    kalman.F, kalman.B, kalman.Q, kalman.H, kalman.R = book.A, book.B, book.Q, book.H, book.R
    kalman.x, kalman.P = book.x, book.P

    def act(tick: Any) -> None:
        for _ in range(1 + tick.replayed):
            kalman.predict(tick.u)
            kalman.update(tick.rows - book.D @ tick.u)

    return act


def plain_numpy(book: Textbook) -> Action:
    """Return the textbook's equations in NumPy, Joseph form."""
    A, B, Q, H, D, R, x, P = book
    state, identity = [x, P], np.eye(x.size)

    def act(tick: Any) -> None:
        for _ in range(1 + tick.replayed):
            x, P = A @ state[0] + B @ tick.u, A @ state[1] @ A.T + Q
            HP = H @ P
            K = np.linalg.solve(HP @ H.T + R, HP).T
            left = identity - K @ H
            state[:] = x + K @ (tick.rows - H @ x - D @ tick.u), left @ P @ left.T + K @ R @ K.T

    return act


def finite_differences(book: Textbook, flow: StateFlow, dt: float) -> Action:
    """Return the extended filter of public code."""
    R, Q, state = book.R, book.Q, [book.x, book.P]

    def move(x: Array, u: Array) -> Array:
        return np.asarray(solve_ivp(lambda _, x: flow.derivative(x, u), (0.0, dt), x).y[:, -1])

    def slopes(function: Callable[[Array], Array], x: Array) -> Array:
        at = function(x)
        return np.column_stack([(function(x + STEP * e) - at) / STEP for e in np.eye(x.size)])

    def act(tick: Any) -> None:
        F = slopes(partial(move, u=tick.u), state[0])
        x, P = move(state[0], tick.u), F @ state[1] @ F.T + Q
        H = slopes(partial(flow.rows, u=tick.u), x)
        K = np.linalg.solve(H @ P @ H.T + R, H @ P).T
        left = np.eye(x.size) - K @ H
        state[:] = x + K @ (tick.rows - flow.rows(x, tick.u)), left @ P @ left.T + K @ R @ K.T

    return act
