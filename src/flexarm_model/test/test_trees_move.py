"""The reduced tree and the segment tree in large motion: tip path, accelerometer and gauge.

Two truncations separate them. The segments' is of second order in their length, and extrapolation removes it.
What is left is the reduced tree's: its displacements are complete to second order in the deflection (the
foreshortening), so the difference must grow with the third power of the torque.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pytest
from arms import Array, arm, tree
from scipy.integrate import solve_ivp

from flexarm_model.manipulator.description import NodeRef
from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.tree.reduced_tree import ReducedTree

SWING = 0.5  # period of the torque [s]; 2 N m turn the light hub by 61 degrees
SETTLE = 0.1  # [s]
Torque = Callable[[float], Array]


@dataclass(frozen=True)
class Run:
    """A motion at common instants: tip position (k, 3), gauge (k,), tip accelerometer (k,), turn [rad]."""

    tip: Array
    strain: Array
    felt: Array
    turn: float


def swing(amplitude: float) -> Torque:
    return lambda t: np.array([amplitude * np.sin(2 * np.pi * t / SWING) if t < SWING else 0.0])


def integrate(arm_tree: Any, forward: Any, torque: Torque, start: list[float], duration: float) -> Array:
    """Return coordinates, rates and accelerations (3, n, k) at 61 instants."""
    n, times = arm_tree.n_q, np.linspace(0, duration, 61)

    def acceleration(t: float, x: Array) -> Array:
        force = np.zeros(n)
        force[arm_tree.actuated] = torque(t)
        return np.array(forward(x[:n], x[n:], force))

    x0 = np.zeros(2 * n)
    x0[arm_tree.actuated] = start
    x = solve_ivp(
        lambda t, x: np.concatenate([x[n:], acceleration(t, x)]), (0, duration), x0,
        method="DOP853", t_eval=times, rtol=1e-8, atol=1e-10,
    ).y  # fmt: skip
    a = np.array([acceleration(t, x[:, k]) for k, t in enumerate(times)]).T
    return np.stack([x[:n], x[n:], a])


def sensor(kind: str) -> Any:
    return next(item for item in arm("single_link").sensors if item.kind == kind)


@cache
def reduced_swing(amplitude: float) -> Run:
    reduced = tree("single_link", "light_hub")
    forward = reduced.functions["forward_dynamics"]
    motion = integrate(reduced, forward, swing(amplitude), [0.0], SWING + SETTLE)
    assert [item.name for item in arm("single_link").sensors][1:3] == ["root_strain", "tip_accelerometer"]
    y = np.array([np.array(reduced.functions["outputs"](*x, x[0])) for x in motion.transpose(2, 0, 1)])
    tip = np.array([reduced.tip_pose(q)[:3, 3] for q in motion[0].T])
    return Run(tip, y[:, 1], y[:, 2], float(motion[0, 0, -1]))


@cache
def segment_swing(amplitude: float, n: int) -> Run:
    segments = SegmentTree(arm("single_link", "light_hub"), n)
    motion = integrate(segments, segments.forward_dynamics, swing(amplitude), [0.0], SWING + SETTLE)
    gauge, site = sensor("strain_gauge"), NodeRef(*sensor("accelerometer").site.split("."))
    strain = np.array([segments.strain(q, gauge) for q in motion[0].T])
    felt = np.array([segments.node_acceleration(q, v, a, site)[1] for q, v, a in motion.transpose(2, 0, 1)])
    tip = np.array([segments.tip_pose(q)[:3, 3] for q in motion[0].T])
    return Run(tip, strain, felt, float(motion[0, 0, -1]))


def limit(amplitude: float, what: str) -> Array:
    """Return the segment tree's value for infinitely many segments, by extrapolation from 8 and 16."""
    coarse, fine = (getattr(segment_swing(amplitude, n), what) for n in (8, 16))
    return np.asarray((4 * fine - coarse) / 3)


def test_the_swing_is_a_large_one() -> None:
    run = reduced_swing(2.0)
    assert np.degrees(run.turn) == pytest.approx(60, abs=3)
    assert abs(run.strain).max() > 2e-4 and abs(run.felt).max() > 15


def test_tip_paths_approach_each_other_with_the_number_of_segments() -> None:
    errors = [abs(segment_swing(1.0, n).tip - reduced_swing(1.0).tip).max() for n in (8, 16)]
    assert errors[1] < errors[0] / 2 and errors[1] < 3e-6


def test_what_is_left_of_the_tip_path_is_third_order_in_the_torque() -> None:
    left = [abs(limit(amplitude, "tip") - reduced_swing(amplitude).tip).max() for amplitude in (1.0, 2.0)]
    assert np.log2(left[1] / left[0]) == pytest.approx(3.0, abs=0.3)
    assert left[1] < 1e-5  # [m] of a path of 0.6 m


def test_gauges_agree_during_the_swing() -> None:
    strain = reduced_swing(2.0).strain
    # the gauge sits 5 mm from the clamp: between the root and the first spring both trees extrapolate
    assert limit(2.0, "strain") == pytest.approx(strain, abs=2e-3 * abs(strain).max())


def test_accelerometers_agree_during_the_swing() -> None:
    felt = reduced_swing(2.0).felt
    # modes that one tree has and the other has not answer the kinks of the torque
    assert limit(2.0, "felt") == pytest.approx(felt, abs=3e-3 * abs(felt).max())


CASES = [("planar", [0.3, 0.9], [1.0, 0.25]), ("spatial", [0.0, -0.5, 1.2], [0.5, 1.0, 0.25])]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "start", "amplitude"), CASES)
def test_arms_of_two_flexible_links_move_alike(name: str, start: list[float], amplitude: list[float]) -> None:
    def torque(t: float) -> Array:
        return np.array([value * np.sin(2 * np.pi * t / 0.2) for value in amplitude])

    def path(arm_tree: ReducedTree | SegmentTree, forward: Any) -> Array:
        motion = integrate(arm_tree, forward, torque, start, 0.1)
        return np.stack([arm_tree.tip_pose(q)[:3, 3] for q in motion[0].T])

    reduced, segments = tree(name), [SegmentTree(arm(name), n) for n in (4, 8)]
    ours = path(reduced, reduced.functions["forward_dynamics"])
    coarse, fine = (path(item, item.forward_dynamics) for item in segments)
    errors = [abs(theirs - ours).max() for theirs in (coarse, fine, (4 * fine - coarse) / 3)]
    assert np.ptp(ours, axis=0).max() > 0.01  # [m]: it does move
    assert errors[1] < errors[0] / 2
    assert errors[2] < 1e-4  # [m]: third order in the deflection, as above
