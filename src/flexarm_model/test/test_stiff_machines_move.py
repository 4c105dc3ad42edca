"""The 3-TPT and the 6R in large fast motion: tool path and gauges of both trees.

The segment tree's error is of second order in the segments' length; its limit is the reduced tree's motion.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from arms import Array, with_modes
from machines import machine
from stiff_motion import Equations, move_stiff, of_reduced, of_segments

from flexarm_model.segments.segment_tree import SegmentTree
from flexarm_model.served.linearize import find_equilibrium
from flexarm_model.tree.reduced_tree import ReducedTree
from flexarm_model.tree.sensors import output_names


@dataclass(frozen=True)
class Swing:
    """A motion: forces of the motors beside those that hold the arm, and how closely the trees must agree.

    Attributes:
        modes: Per beam, enough that those left out do not count.
        step, duration: [s].
        drive: Size of the forces [N m or N], (n_theta,).
        reach: The tool moves further than this [m].
        path: Largest difference of the tool's path to that of infinitely many segments [m].
    """

    modes: int
    step: float
    duration: float
    drive: tuple[float, ...]
    reach: float
    path: float

    def force(self, t: float) -> Array:
        """Return the forces that move the arm, smooth at both ends."""
        turn = np.pi * t / self.duration
        return np.asarray(np.sin(2 * turn) * np.sin(turn) ** 2 * np.array(self.drive))


SWINGS = {
    "spatial_3tpt": Swing(9, 2e-4, 0.1, (96.0, -64.0, 40.0), 0.02, 2e-9),
    "serial_6r": Swing(8, 5e-4, 0.3, (960.0, -800.0, 480.0, 96.0, 80.0, 48.0), 0.07, 5e-8),
}
GAUGES = 5e-3  # largest difference of the gauges, as a share of the largest strain
# the gauges' values hang on the modes of their own beam; the tool's path hardly does


def held(eq: Equations, q: Array) -> Array:
    """Return the motors' forces at rest, (n_theta,)."""
    bias, G = eq.motion(q, 0 * q)[1], eq.rows(q)[1]
    free = np.setdiff1d(np.arange(q.size), eq.actuated)
    in_rows = np.linalg.lstsq(G[:, free].T, -bias[free], rcond=None)[0] if G.size else np.zeros(0)
    return np.asarray((bias + G.T @ in_rows)[eq.actuated])


def run(eq: Equations, start: Array, swing: Swing) -> Array:
    """Return the coordinates on the way, (k, n_q)."""
    rest, count = held(eq, start), round(swing.duration / swing.step)
    return move_stiff(eq, start, swing.step, count, lambda t: rest + swing.force(t))


@cache
def reduced_swing(name: str) -> tuple[Array, Array]:
    """Return the tool's path (k, 3) and the gauges (k, n), both less their values at the start."""
    swing = SWINGS[name]
    tree = ReducedTree(with_modes(machine(name), swing.modes, 16), use_compiler=False)
    start, _ = find_equilibrium(tree, tree.config.home)
    path = run(of_reduced(tree), start, swing)
    outputs, names = tree.functions["outputs"], output_names(tree.config)
    rows = [i for i, row in enumerate(names) if row.endswith(".strain")]
    y = np.array([np.array(outputs(q, 0 * q, 0 * q, q)).ravel()[rows] for q in path])
    tip = np.array([tree.tip_pose(q)[:3, 3] for q in path])
    return tip - tip[0], y - y[0]


@cache
def segment_swing(name: str, n: int) -> tuple[Array, Array]:
    """Return the same of the segment tree."""
    tree = SegmentTree(machine(name), n)
    start = tree.settle(tree.config.home)
    path = run(of_segments(tree, start), start, SWINGS[name])
    gauges = [sensor for sensor in tree.config.sensors if sensor.kind == "strain_gauge"]
    y = np.array([[tree.strain(q, gauge) for gauge in gauges] for q in path])
    tip = np.array([tree.tip_pose(q)[:3, 3] for q in path])
    return tip - tip[0], y - y[0]


@pytest.mark.slow
@pytest.mark.parametrize("name", SWINGS)
@pytest.mark.parametrize(("what", "index"), [("path", 0), ("gauges", 1)])
def test_the_segment_tree_approaches_a_limit_with_at_least_the_second_order(
    name: str, what: str, index: int
) -> None:
    two, four, eight = (segment_swing(name, n)[index] for n in (2, 4, 8))
    order = np.log2(np.linalg.norm(four - two) / np.linalg.norm(eight - four))
    assert order > 1.95, what  # 2.0 for most; where gauges sit between two springs, the first step is longer


@pytest.mark.slow
@pytest.mark.parametrize("name", SWINGS)
def test_the_limit_is_the_motion_of_the_reduced_tree(name: str) -> None:
    tip, strain = reduced_swing(name)
    (tip_4, strain_4), (tip_8, strain_8) = (segment_swing(name, n) for n in (4, 8))
    assert np.ptp(tip, axis=0).max() > SWINGS[name].reach
    assert abs((4 * tip_8 - tip_4) / 3 - tip).max() < SWINGS[name].path
    left = abs((4 * strain_8 - strain_4) / 3 - strain).max(axis=0)
    assert (left < GAUGES * abs(strain).max()).all()


@pytest.mark.slow
def test_implicit_steps_follow_an_arm_without_stiffness_as_an_explicit_integrator_does() -> None:
    """The stiff steps' own oracle: the single link, which both can integrate."""
    from scipy.integrate import solve_ivp

    tree = ReducedTree(machine("single_link"), use_compiler=False)
    eq, start, swing = of_reduced(tree), np.zeros(tree.n_q), Swing(3, 1e-4, 0.2, (20.0,), 0.0, 0.0)

    def rate(t: float, x: Array) -> Array:
        M, bias = eq.motion(x[: tree.n_q], x[tree.n_q :])
        push = -bias
        push[eq.actuated] += swing.force(t)
        return np.concatenate([x[tree.n_q :], np.linalg.solve(M, push)])

    exact = solve_ivp(rate, [0, 0.2], np.zeros(2 * tree.n_q), method="DOP853", rtol=1e-10, atol=1e-12)
    errors = []
    for step in (2e-4, 1e-4):
        path = move_stiff(eq, start, step, round(0.2 / step), swing.force)
        errors.append(float(abs(path[-1] - exact.y[: tree.n_q, -1]).max()))
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)
