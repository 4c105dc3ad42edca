"""The motion of least torque that leaves no mode ringing, as a reference that keeps the limit of velocity.

The linear program keeps the velocity at the ends of its periods. A reference runs through these on cubics,
which are faster in between: where the limit binds, whoever should follow it would refuse it. So the program
is solved again with a bound that is smaller by that much, until the reference fits.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from flexarm_bringup.compare_laws.legs import ComparedLeg
from flexarm_bringup.compare_laws.sampled import speed_share
from flexarm_controller.open_loop.axis_motion import SampledMotion
from flexarm_controller.open_loop.rest_to_rest import RestToRest, TorquePlan

ROUNDS = 8  # every one makes what is beyond the limit ten times smaller or more
BELOW = 1e-7  # of the limit, by which a bound is set below what would just do


def least_torque(leg: ComparedLeg, periods: int) -> SampledMotion:
    """Return the motion of so many control periods, from rest to rest.

    Raises:
        ValueError: There is none within the limits.
    """
    bound = leg.limits.velocity
    for _ in range(ROUNDS):
        slower = replace(leg.limits, velocity=bound)
        plan = RestToRest(leg.middle, slower, leg.start, leg.goal, leg.dt).solve(periods)
        if plan is None:
            break
        motion = _of_plan(leg, plan)
        share = speed_share(motion, leg.limits, leg.dt)
        if (share <= 1.0).all():
            return motion
        bound = np.where(share > 1.0, bound / share * (1.0 - BELOW), bound)
    raise ValueError(f"no motion of {periods * leg.dt:.3g} s within the limits leaves the modes at rest")


def _of_plan(leg: ComparedLeg, plan: TorquePlan) -> SampledMotion:
    """Return how the axes move under a plan of torques."""
    n, m = leg.model.n, leg.model.n_theta
    return SampledMotion(plan.dt, plan.x[:, :m], plan.x[:, n : n + m])
