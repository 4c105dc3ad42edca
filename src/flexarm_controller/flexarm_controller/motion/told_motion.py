"""What a reference from outside says that no arm can do, or that contradicts itself.

An axis cannot stop in no time, so the last point rests. And accelerations have to be those of the positions:
tools that know none fill them with zeros, and torque and strain would be those of a motion without any. They
are believed where they lie, nearly all the time, between those of the cubics on either side of a point, or
beside them by no more than `BESIDE` of the largest; else the cubics' are taken throughout.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.motion.excess import resolution_of
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.reference import Reference
from flexarm_model.settings.units import is_sliding

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
MOVES = 1e-3  # of the velocity limit, or of the largest velocity where there is none: the last point moves
STILL = 1e-6  # rad/s or m/s, and rad/s^2 or m/s^2, of which nobody asks
BESIDE = 0.1  # of the largest acceleration of the axis
SELDOM = 0.05  # of the time: a point at which the acceleration jumps may tell either


def refuse_moving_end(reference: Reference, limits: Limits, names: Sequence[str]) -> None:
    """Refuse a reference whose last point moves.

    Args:
        reference: Of the axes.
        limits: Of the arm.
        names: Of the axes, "joint.axis".

    Raises:
        MotionError: Names axis and velocity.
    """
    last, largest = abs(reference.theta_dot[-1]), abs(reference.theta_dot).max()
    over = last - STILL - MOVES * np.where(np.isfinite(limits.velocity), limits.velocity, largest)
    axis = int(over.argmax())
    if over[axis] > 0.0:
        velocity, unit = reference.theta_dot[-1, axis], "m/s" if is_sliding(names[axis]) else "rad/s"
        raise MotionError(
            f"axis {names[axis]}: moves at its last point, with {velocity:.4g} {unit}; expected 0 there: "
            "no axis stops in no time"
        )


def with_own_accelerations(reference: Reference, names: Sequence[str]) -> tuple[Reference, str]:
    """Return the reference with accelerations that go with its positions, and a remark where they did not.

    Args:
        reference: Of the axes.
        names: Of the axes, "joint.axis".
    """
    if reference.t.size == 1:
        return reference, ""
    own = Reference.through(reference.t, reference.theta, reference.theta_dot)
    after, before = own.theta_ddot.copy(), own.before(own.t).copy()
    before[0], after[-1] = after[0], before[-1]  # at the ends there is one
    low, high, h = np.minimum(after, before), np.maximum(after, before), np.diff(reference.t)[:, None]
    allowed = BESIDE * np.maximum(abs(low), abs(high)).max(axis=0) + STILL + _of_stamps(reference)
    told = reference.theta_ddot
    told_before = told if reference.theta_ddot_before is None else reference.theta_ddot_before
    off_after, off_before = (abs(each - np.clip(each, low, high)) for each in (told, told_before))
    is_wrong = np.maximum(off_after[:-1], off_before[1:]) > allowed  # in every interval
    largest = np.maximum.reduce([abs(each) for each in (after[:-1], before[1:], told[:-1], told_before[1:])])
    share = _share_of_time(h, is_wrong, largest > allowed)
    axis = int(share.argmax())
    if share[axis] <= SELDOM:
        return reference, ""
    k, unit = int(off_after[:, axis].argmax()), "m/s²" if is_sliding(names[axis]) else "rad/s²"
    return own, (
        f"accelerations that do not go with the positions are not believed: axis {names[axis]} tells "
        f"{told[k, axis]:.4g} {unit} at {reference.t[k] - reference.t[0]:.3f} s, "
        f"where it has {after[k, axis]:.4g}"
    )


def _share_of_time(h: Array, is_wrong: Mask, accelerates: Mask) -> Array:
    """Return the share of the time that is told wrongly, of all of it or where an axis accelerates, (n,).

    A rest or a cruise says nothing of how right accelerations are, and a long one would hide a short motion.
    There an interval counts as right beside one that is: where the acceleration jumps either may be told.

    Args:
        h: Length of every interval [s], (k, 1).
        is_wrong: What is told there is wrong, (k, n).
        accelerates: The axis does there, or is said to, (k, n).
    """
    is_right = np.pad(accelerates & ~is_wrong, ((1, 1), (0, 0)))
    is_lonely = is_wrong & ~is_right[:-2] & ~is_right[2:]
    accelerating = np.maximum((h * (accelerates | is_wrong)).sum(axis=0), h.min())
    of_all, of_motion = (h * is_wrong).sum(axis=0) / h.sum(), (h * is_lonely).sum(axis=0) / accelerating
    return np.asarray(np.maximum(of_all, of_motion))


def _of_stamps(reference: Reference) -> float:
    """Return what rounded instants may make of an acceleration: a cubic goes its way whatever time it has."""
    v, h = abs(reference.theta_dot).max(), np.diff(reference.t).min()
    return float(12.0 * v * resolution_of(reference) / h**2)
