"""A described arm with its planner, and what is true of it: inverse dynamics along motions, no vibration.

They are those of ``linearize`` at the pose, and of ``turning_loads`` for products of velocities.
"""

from itertools import combinations_with_replacement

import numpy as np

from flexarm_controller.guard_settings import GuardSettings, guard_limits
from flexarm_controller.guarding.pose_loads import loads_of
from flexarm_controller.limits import limits_of
from flexarm_controller.motion.arm_loads import ArmLoads
from flexarm_controller.motion.planner import MotionPlanner
from flexarm_controller.motion.point_to_point import MotionState
from flexarm_controller.motion.settings import MotionConfig
from flexarm_model.reading.config import load_config
from flexarm_model.reading.manipulator_file import find_manipulator
from flexarm_model.served.linearize import linearize
from flexarm_model.tree.reduced_tree import ReducedTree

SETTLING = 30  # steps of Newton's method
ALMOST = 0.02  # of the limit: between poses inertia is so far from the truth; of 20 goals the worst is 0.001


class Arm:
    """An arm with its served model at home, and what is true of it elsewhere."""

    def __init__(self, name, use_compiler=True):
        self.config = load_config(find_manipulator(name))
        self.tree = ReducedTree(self.config, use_compiler=use_compiler)
        self.model, self.limits = linearize(self.tree), limits_of(self.config)
        self.loads = ArmLoads(self.tree, self.limits)
        self.ranges = guard_limits(self.config, self.tree, GuardSettings()).ranges

    def planner(self, **settings):
        return MotionPlanner(self.model, self.limits, MotionConfig(**settings), self.ranges, self.loads)

    def goals(self, seed, count):
        low, high = self.limits.position_low, self.limits.position_high
        return low + np.random.default_rng(seed).uniform(0.1, 0.9, (count, low.size)) * (high - low)

    def torques(self, theta, theta_dot, theta_ddot):
        """Return what a motion without vibration asks, (k, n_theta)."""
        asked = []
        for pose, v, a in zip(theta, theta_dot, theta_ddot, strict=True):
            model = linearize(self.tree, pose)
            known = loads_of(self.tree, model)
            pairs = combinations_with_replacement(range(v.size), 2)
            turning = np.array(known.turning) @ [v[j] * v[k] for j, k in pairs]
            D = model.D[: v.size, : v.size]
            asked.append(known.holding + np.array(known.inertia) @ a + D @ v + turning)
        return np.array(asked)

    def shapes(self, theta, theta_dot, theta_ddot):
        """Return the coordinates at rest, and bent by what a motion asks without vibration, (n_q,) each.

        What no motor holds is at rest under all forces, products of deflections included, of which the loads
        of a pose are the first order. Of an arm without loops.
        """
        tree, model = self.tree, linearize(self.tree, theta)
        T, free = model.Phi[:, : theta.size], np.delete(np.arange(tree.n_q), tree.actuated)
        found = []
        for rates, accelerations in ((0.0 * theta, 0.0 * theta), (theta_dot, theta_ddot)):
            q = model.q0.copy()
            for _ in range(SETTLING):
                force = np.array(tree.functions["bias"](q, T @ rates)).ravel()
                force = force + tree.mass_matrix(q) @ (T @ accelerations)
                K = np.array(tree.functions["stiffness"](q))[np.ix_(free, free)]
                q[free] -= np.linalg.solve(K, force[free])
            found.append(q)
        return found

    def peak(self, motion, count):
        t = np.linspace(motion.t[0], motion.t[-1], count + 2)[1:-1]
        return float((abs(self.torques(*motion.sample(t))) / self.limits.effort).max())


def at_rest(pose):
    return MotionState(np.array(pose), np.zeros(len(pose)), np.zeros(len(pose)))
