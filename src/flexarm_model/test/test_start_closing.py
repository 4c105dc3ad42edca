"""An arm that starts elsewhere is put together as it is when it comes there from home."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import fsolve

from flexarm_model.manipulator.start_pose import starting_at
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

CRANK = Path(__file__).parents[2] / "flexarm_bringup" / "test" / "arms" / "massless_crank.yaml"
LENGTHS = 0.1, 0.3, 0.25, 0.3  # m: crank, coupler, rocker, base of the four-bar linkage


def inertia(theta: float, start: tuple[float, float]) -> float:
    """Return the crank's inertia by the kinetic energy of coupler and rocker, both 1 kg, closed from home."""
    crank, coupler, rocker, base = LENGTHS

    def angles(at: float, near: np.ndarray) -> np.ndarray:
        def gap(x: np.ndarray) -> list[float]:
            c, s = np.cos([at, *x]), np.sin([at, *x])
            return [
                crank * c[0] + coupler * c[1] - rocker * c[2] - base,
                crank * s[0] + coupler * s[1] - rocker * s[2],
            ]

        return np.asarray(fsolve(gap, near, xtol=1e-13))

    x = np.array(start)
    for at in np.linspace(np.radians(60.0), theta, 40):
        x = angles(at, x)

    def place(at: float) -> np.ndarray:
        a, b = angles(at, x)
        c, s = np.cos([at, a]), np.sin([at, a])
        return np.array([crank * c[0] + 0.15 * c[1], crank * s[0] + 0.15 * s[1], a, b])

    h = 1e-5
    vx, vy, a, b = (place(theta + h) - place(theta - h)) / (2 * h)
    return float(vx**2 + vy**2 + 1e-3 * a**2 + (1e-3 + 0.125**2) * b**2)


@pytest.mark.parametrize("degrees", [-80.0, 20.0, 90.0, 150.0, 190.0])
def test_a_linkage_that_starts_at_a_pose_is_the_one_that_came_there(degrees: float) -> None:
    """At 90 deg its elbow was on the other side: an inertia of 0.0050 instead of 0.0116 kg m^2."""
    config, pose = load_config(find_manipulator(str(CRANK))), np.radians([degrees])
    started = linearize(ReducedTree(starting_at(config, pose), use_compiler=False))
    there = linearize(ReducedTree(config, use_compiler=False), pose)
    np.testing.assert_allclose(started.M, there.M, rtol=1e-9)
    np.testing.assert_allclose(started.M[0, 0], inertia(float(pose[0]), (0.5, 1.57)), rtol=1e-6)


def test_arms_that_came_along_start_at_their_poses_as_ever() -> None:
    for name in ("planar_3rrr", "spatial_3tpt"):
        config = load_config(find_manipulator(name))
        for pose in config.poses.values():
            started = linearize(ReducedTree(starting_at(config, pose), use_compiler=False))
            there = linearize(ReducedTree(config, use_compiler=False), pose)
            np.testing.assert_allclose(started.omega, there.omega, rtol=1e-9)
