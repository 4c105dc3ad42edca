"""How fast is this machine now? Bounds of time mean a class of machine; a step of plain filterpy tells.

The speed of a shared machine varies by several times, within minutes. Interpreted loops hardly show it (they
stay in the caches), small matrices in NumPy do, and so does everything that flexarm times.
"""

from __future__ import annotations

import time

import numpy as np

STATES, ROWS = 18, 9
CLASS_US = 27.0  # median CPU time of that step where the bounds were set [us]
STEPS = 2000
WARM_UP = 20


def filterpy_step_us(steps: int = STEPS) -> float:
    """Return the median CPU time of one predict and update of plain filterpy, 18 states and 9 rows [us].

    Args:
        steps: How many are timed, after ``WARM_UP`` others.
    """
    from filterpy.kalman import KalmanFilter  # loads all of scipy.stats, for who does not ask, too

    rng = np.random.default_rng(0)
    kalman = KalmanFilter(dim_x=STATES, dim_z=ROWS)
    kalman.F = 0.95 * np.linalg.qr(rng.normal(size=(STATES, STATES)))[0]
    kalman.H = rng.normal(size=(ROWS, STATES))
    kalman.Q, kalman.R = 1e-3 * np.eye(STATES), 1e-2 * np.eye(ROWS)
    said = rng.normal(size=(WARM_UP + steps, ROWS))
    spent = np.empty(len(said))
    for k, rows in enumerate(said):
        start = time.thread_time_ns()
        kalman.predict()
        kalman.update(rows)
        spent[k] = (time.thread_time_ns() - start) * 1e-3
    return float(np.median(spent[WARM_UP:]))


def slowness(*steps_us: float) -> float:
    """Return how many times as long everything takes here as on the class of machine, 1 at least.

    Args:
        steps_us: What ``filterpy_step_us`` took before and after what is judged; the fastest counts.
    """
    return max(min(steps_us) / CLASS_US, 1.0)


def in_words(slow: float) -> str:
    """Return what ``slowness`` has found, for people."""
    return (
        f"plain filterpy takes {slow * CLASS_US:.0f} us here for {STATES} states and {ROWS} rows, "
        f"{slow:.2f} times what it takes on machines of the class that bounds of time mean"
    )
