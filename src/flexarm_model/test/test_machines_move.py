"""The 3RRR in large fast motion: platform path and gauges of both trees.

The reduced tree's displacements are complete to second order in the deflection, so what is left when the
segments' own error is extrapolated away must grow with the third power of the torque.
"""

from __future__ import annotations

from functools import cache, partial

import numpy as np
import pytest
from arms import Array, with_modes
from closed_motion import forward_dynamics, move
from machines import machine

from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.served.linearize import find_equilibrium
from flexarm_model.tree.reduced_tree import ReducedTree

TIMES = np.linspace(0, 0.3, 31)  # [s]: one swing of the torque
DRIVE = np.array([0.4, -0.25, 0.15])  # [N m]: turns the motors by 16, 10 and 7 degrees
GAUGES = [sensor for sensor in machine("planar_3rrr").sensors if sensor.kind == "strain_gauge"]


def torque(t: float, share: float) -> Array:
    return share * DRIVE * np.sin(2 * np.pi * t / TIMES[-1])


@cache
def reduced_3rrr() -> ReducedTree:
    """Return the reduced tree with modes enough that those it leaves out do not count."""
    return ReducedTree(with_modes(machine("planar_3rrr"), 5, 16), use_compiler=False)


@cache
def reduced_swing(share: float) -> tuple[Array, Array]:
    """Return platform path (k, 3) and gauges (k, 6)."""
    reduced, config = reduced_3rrr(), machine("planar_3rrr")
    start, _ = find_equilibrium(reduced, config.home)
    path = move(
        partial(forward_dynamics, reduced), reduced.actuated, start, TIMES, partial(torque, share=share)
    )
    outputs, rest = reduced.functions["outputs"], 0 * start
    y = np.array([np.array(outputs(q, rest, rest, q)) for q in path])
    at = [[sensor.name for sensor in config.sensors].index(gauge.name) for gauge in GAUGES]
    return np.array([reduced.tip_pose(q)[:3, 3] for q in path]), y[:, at]


@cache
def segment_swing(share: float, n: int) -> tuple[Array, Array]:
    """Return the same of the segment tree."""
    segments = SegmentTree(machine("planar_3rrr"), n)
    start = segments.settle(machine("planar_3rrr").home)
    path = move(segments.forward_dynamics, segments.actuated, start, TIMES, partial(torque, share=share))
    assert abs(segments.loops.residual(path[-1])).max() < 1e-8
    tip = np.array([segments.tip_pose(q)[:3, 3] for q in path])
    return tip, np.array([[segments.strain(q, gauge) for gauge in GAUGES] for q in path])


def left(share: float) -> tuple[float, float]:
    """Return the largest difference of path [m] and gauges [1] to infinitely many segments."""
    (tip_4, strain_4), (tip_8, strain_8) = (segment_swing(share, n) for n in (4, 8))
    tip, strain = reduced_swing(share)
    return (
        float(abs((4 * tip_8 - tip_4) / 3 - tip).max()),
        float(abs((4 * strain_8 - strain_4) / 3 - strain).max()),
    )


@pytest.mark.slow
def test_the_3rrr_moves_and_strains_alike_in_both_trees() -> None:
    tip, strain = reduced_swing(0.25)
    assert np.ptp(tip, axis=0).max() > 0.015 and abs(strain).max() > 1.5e-4
    path, gauges = left(0.25)
    assert path < 1e-5  # [m]
    assert gauges < 0.01 * abs(strain).max()


@pytest.mark.slow
def test_what_is_left_of_the_3rrrs_path_and_gauges_is_third_order_in_the_torque() -> None:
    assert np.ptp(reduced_swing(1.0)[0], axis=0).max() > 0.06  # [m]
    (path, gauges), (path_half, gauges_half) = left(1.0), left(0.5)
    assert np.log2(path / path_half) == pytest.approx(3.0, abs=0.3)
    assert np.log2(gauges / gauges_half) == pytest.approx(3.0, abs=0.3)
