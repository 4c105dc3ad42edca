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

    def peak(self, motion, count):
        t = np.linspace(motion.t[0], motion.t[-1], count + 2)[1:-1]
        return float((abs(self.torques(*motion.sample(t))) / self.limits.effort).max())


def at_rest(pose):
    return MotionState(np.array(pose), np.zeros(len(pose)), np.zeros(len(pose)))
