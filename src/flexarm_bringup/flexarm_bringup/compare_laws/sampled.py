"""Motions of a comparison as whoever follows them gets them: samples about every period."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from flexarm_bringup.tasks.task_moves import AxisMotion
from flexarm_controller.limits import Limits
from flexarm_controller.motion.excess import peaks
from flexarm_controller.open_loop.axis_motion import Motion
from flexarm_controller.reference import Reference

Array = NDArray[np.float64]


def sample_motion(motion: Motion, dt: float) -> AxisMotion:
    """Return a motion by its samples about every ``dt`` [s]; it ends at rest."""
    t = np.append(np.arange(0.0, motion.duration - dt / 2, dt), motion.duration)
    theta, theta_dot, theta_ddot = motion.sample(t)
    theta_dot[-1] = theta_ddot[-1] = 0.0
    return AxisMotion(t, theta, theta_dot, theta_ddot)


def speed_share(motion: Motion, limits: Limits, dt: float) -> Array:
    """Return the largest speed of every axis over its limit, between the samples too [1], (n_theta,).

    Args:
        motion: Of the axes.
        limits: Of the arm.
        dt: Between two samples of the reference [s].
    """
    sampled = sample_motion(motion, dt)
    reference = Reference(sampled.t, sampled.theta, sampled.theta_dot, sampled.theta_ddot)
    by_quantity = {name: values for name, _, values in peaks(reference, None)}
    return np.asarray(abs(by_quantity["velocity"]).max(axis=0) / limits.velocity)
