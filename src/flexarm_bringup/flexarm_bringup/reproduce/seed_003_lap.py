"""Seed 003, path test: one lap of a square with rounded corners, by a rigid and by a flexible robot.

Both are driven by the same loops on their motors, a proportional position loop around a proportional-integral
velocity loop, with the torques that the rigid robot without friction needs fed forward::

    e   = theta_r' + k_p (theta_r - theta) - theta'
    tau = tau_rigid(theta_r, theta_r', theta_r'') + K_v (e + k_i int e dt)

Rule for the gains, all assumed: ``K_v = w M_ii``, ``k_p = k_i = w / 4``, with w the slowest mode with the
motors locked at the start of the path and M the inertia of the rigid robot, rotors included, in the middle
of the joints' ranges. The rigid robot is the description with its beams rigid and its bushings welded.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from flexarm_bringup.reproduce.seed_003_data import robot, with_axes
from flexarm_bringup.sim.implicit_steps import ImplicitSteps
from flexarm_model.bodies.model_order import with_rigid_beams
from flexarm_model.kinematics.joint_path import JointMotion, follow
from flexarm_model.kinematics.paths import CartesianMotion, at_speed, rounded_square, travel
from flexarm_model.kinematics.spherical_wrist import SphericalWristArm
from flexarm_model.served.linear_assembly import assemble
from flexarm_model.tree.reduced_tree import ReducedTree

Array = NDArray[np.float64]

GEOMETRY = SphericalWristArm(d1=0.50, a1=0.18, a2=0.80, a3=0.15, d4=0.85, d6=0.14)  # seed 003, section 2
CENTRE, SIDE, RADIUS = (1.25, 0.0, 0.80), 0.40, 0.05  # m
SPEED, ACCELERATION = 0.5, 5.0  # m/s, m/s^2: at both ends, and what the corners take
TOOL_DOWN = np.diag([1.0, -1.0, -1.0])
NEAR = np.radians([0.0, 20.0, 10.0, 0.0, 60.0, 0.0])  # of the eight solutions
PERIOD = 1e-3  # s, of the drives and of the integrator: modes below 30 Hz are 0.3 % slow, 5 um in the end
INNER = 4.0  # times faster than position loop and integral is the velocity loop
STAND_EVERY = 20  # samples of the path from one place to stand at to the next
SAG_STEPS = 4  # gravity's own stiffness is a thousandth of the springs': each step gains three digits


@dataclass(frozen=True)
class Lap:
    """The lap as it is asked for.

    Attributes:
        path: Motion of the flange.
        joints: Motion of the motors.
    """

    path: CartesianMotion
    joints: JointMotion

    @property
    def is_steady(self) -> NDArray[np.bool_]:
        """Samples at full speed, without the ramps at both ends, (k,)."""
        ramp, t = SPEED / ACCELERATION, self.path.t
        return np.asarray((t > ramp) & (t < t[-1] - ramp))


@dataclass(frozen=True)
class Case:
    """One run.

    Attributes:
        is_flexible: The robot as described; otherwise the rigid one.
        has_friction: Viscous friction at the motors, as described; otherwise none.
        is_known: The friction at the commanded speed is fed forward.
        stiffness: Bandwidth of the drives over that of the rule [1].
    """

    is_flexible: bool
    has_friction: bool
    is_known: bool = False
    stiffness: float = 1.0


@dataclass(frozen=True)
class Drives:
    """Gains of the joint loops.

    Attributes:
        frequency: w of the rule [rad/s].
        K_v: Torque per error of the velocity [N m s/rad], (6,).
        k_p: Velocity per error of the position [1/s].
        k_i: Rate of the integral [1/s].
    """

    frequency: float
    K_v: Array
    k_p: float
    k_i: float


@cache
def lap() -> Lap:
    """Return the lap at the instants of the drives."""
    way = rounded_square(np.array(CENTRE), SIDE, RADIUS)
    profile = at_speed(way.length, SPEED, ACCELERATION)
    t = np.asarray(PERIOD * np.arange(int(profile.duration / PERIOD) + 1), dtype=np.float64)
    path = travel(way, TOOL_DOWN, profile, t)
    return Lap(path, follow(GEOMETRY.nearest, GEOMETRY.chain.jacobian, path, NEAR))


@cache
def rigid_tree() -> ReducedTree:
    """Return the dynamics of the rigid robot, (6,)."""
    rigid = with_axes(with_rigid_beams(robot()), lambda joint, axis: False)
    return ReducedTree(rigid, use_compiler=False)


@cache
def flexible_tree() -> ReducedTree:
    """Return the dynamics of the robot as described, (84,)."""
    return ReducedTree(robot(), use_compiler=False)  # no compiler for a few seconds of motion


def friction() -> Array:
    """Return the viscous friction at the motors, output side [N m s/rad], (6,)."""
    return np.array([axis.damping for axis in robot().actuated.values()])


def rigid_torques(motion: JointMotion) -> Array:
    """Return the torques of the rigid robot without friction, Coriolis terms included [N m], (k, 6)."""
    inverse = rigid_tree().functions["inverse_dynamics"]
    samples = zip(motion.theta, motion.theta_dot, motion.theta_ddot, strict=True)
    return np.array([inverse(*sample).copy() for sample in samples]) - friction() * motion.theta_dot


@cache
def tune_drives(stiffness: float = 1.0) -> Drives:
    """Return the gains by the rule.

    Args:
        stiffness: Bandwidth over that of the rule [1].
    """
    joints = lap().joints
    start = dict(zip(robot().actuated, joints.theta[0].tolist(), strict=True))
    M, _, K = assemble(robot(), start).locked()
    frequency = stiffness * float(np.sqrt(eigh(K, M, eigvals_only=True, subset_by_index=[0, 0])[0]))
    middle = (joints.theta.min(axis=0) + joints.theta.max(axis=0)) / 2
    inertia = np.diag(rigid_tree().functions["mass_matrix"](middle)).copy()
    return Drives(frequency, frequency * inertia, frequency / INNER, frequency / INNER)


def sagged(theta: Array) -> Array:
    """Return the coordinates of the flexible robot at rest with its motors at theta (6,), (84,)."""
    tree = flexible_tree()
    q = np.zeros(tree.n_q)
    q[tree.actuated] = theta
    e = np.setdiff1d(np.arange(tree.n_q), tree.actuated)
    for _ in range(SAG_STEPS):
        force = tree.functions["motion"](q, np.zeros(tree.n_q))[1]
        q[e] -= np.linalg.solve(tree.K[np.ix_(e, e)], force[e])
    return q


@cache
def drive_lap(case: Case) -> Array:
    """Return where the flange is at the instants of the lap [m], (k, 3).

    Both robots have friction as described; where there is to be none, a torque gives back in every period
    what the friction takes at the speed of its start.
    """
    joints, drives = lap().joints, tune_drives(case.stiffness)
    tree = flexible_tree() if case.is_flexible else rigid_tree()
    steps, t, c = ImplicitSteps(tree, PERIOD, 1, 0.0), tree.actuated, friction()
    q = sagged(joints.theta[0]) if case.is_flexible else joints.theta[0]
    v, integral, places = np.zeros(tree.n_q), np.zeros(len(c)), []
    forward = rigid_torques(joints) + (c * joints.theta_dot if case.is_known else 0.0)
    for theta, theta_dot, tau in zip(joints.theta, joints.theta_dot, forward, strict=True):
        places.append(tree.tip_pose(q)[:3, 3])
        error = theta_dot + drives.k_p * (theta - q[t]) - v[t]
        integral += drives.k_i * PERIOD * error
        given_back = 0.0 if case.has_friction else c * v[t]
        q, v, _ = steps.drive(q, v, tau + drives.K_v * (error + integral) + given_back)
    return np.array(places)


def stand_on_path() -> Array:
    """Return where the flexible robot stands with its motors on the path, at rest [m], (k, 3)."""
    tree = flexible_tree()
    return np.array([tree.tip_pose(sagged(theta))[:3, 3] for theta in lap().joints.theta[::STAND_EVERY]])


def outside(places: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Return how far outside the square places lie, and which lie at a corner.

    Args:
        places: (k, 3); only x and y count.

    Returns:
        Horizontal distance from the path [m], negative inside, and whether the nearest point is on an arc,
        (k,) each.
    """
    beyond = abs(places[:, :2] - np.array(CENTRE[:2])) - (SIDE / 2 - RADIUS)  # the corner's centre
    from_centre = np.hypot(*np.maximum(beyond, 0.0).T) + np.minimum(beyond.max(axis=1), 0.0)
    return from_centre - RADIUS, (beyond > 0.0).all(axis=1)
