"""What leads the axes: one reference after the other, without a jump, whatever begins later waiting its turn.

A reference that begins while another is under way takes over when it begins; until then, or until it ends,
the one under way is followed. The newest is right from its begin on: what was to begin later than that is
gone. Laws that look ahead see what is followed as one reference.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.reference import Reference, hold, splice
from flexarm_controller.reference_jump import without_jump

Array = NDArray[np.float64]
NEXT = 1.5  # periods; what begins sooner begins with the next state


class ReferenceQueue:
    """Joins references.

    Attributes:
        reference: What is followed, or shall be when the axes are led; None when nothing is.
        is_led: The axes are led by it.
    """

    def __init__(self, velocity: Array, dt: float) -> None:
        """Start empty.

        Args:
            velocity: Limit of the axes [rad/s] or [m/s], (n_theta,).
            dt: Control period [s].
        """
        self._velocity, self._dt = velocity, dt
        self.clear()

    @property
    def leading(self) -> Reference | None:
        """What leads the axes; None while nothing does."""
        return self.reference if self.is_led else None

    def clear(self) -> None:
        """Follow nothing, now and later."""
        self.is_led = False
        self.reference: Reference | None = None
        self._former: list[tuple[Reference, float]] = []  # what is part of it, and until when [s]
        self._begin = -math.inf

    def lead(self, theta: Array, t: float) -> None:
        """Begin at ``t`` [s] to lead axes that are at ``theta`` [rad] or [m], (n_theta,)."""
        self.reference, self.is_led = self._without_jump(theta, self.reference or hold(theta, t), t), True

    def take(self, reference: Reference, t: float) -> None:
        """Let a reference follow on what leads the axes at ``t`` [s]; where none does, on no other."""
        before, self._begin = self.reference, float(reference.t[0])
        if before is None or not self.is_led:
            self.reference = reference
            return
        meet = min(float(before.t[-1]), float(reference.t[0]))
        meet = meet if meet > t + NEXT * self._dt else t
        after = self._without_jump(before.position(meet), reference, meet)
        begin = float(after.t[0])
        self._former = [(part, until) for part, until in self._former if t < until < begin]
        if begin > t:
            self._former.append((before, begin))
        if meet > t:
            after = splice(_with_sample(before, begin - self._dt), after, t)
        self.reference = after

    def follows(self, reference: Reference | None, t: float) -> bool:
        """Tell whether this very reference is followed at ``t`` [s], or waits for its begin."""
        waiting = [part for part, until in self._former if t < until] + [self.reference]
        return any(part is reference for part in waiting)

    def has_to_begin(self, t: float) -> bool:
        """Tell whether at ``t`` [s] the newest reference has still to begin."""
        return self.reference is not None and self._begin > t

    def drop(self, before: float) -> float | None:
        """Forget a reference that nobody follows yet and that begins before a time [s]; return its begin."""
        if self.is_led or self.reference is None or not self.reference.t[0] < before:
            return None
        begun = float(self.reference.t[0])
        self.clear()
        return begun

    def _without_jump(self, theta: Array, reference: Reference, t: float) -> Reference:
        return without_jump(theta, reference, t, self._velocity, self._dt)


def _with_sample(reference: Reference, t: float) -> Reference:
    """Return the same motion with a sample at ``t`` [s]: what is joined there changes nothing before it."""
    at = int(np.searchsorted(reference.t, t))
    if at < reference.t.size and reference.t[at] == t:
        return reference
    once, before = np.array([t]), reference.theta_ddot_before
    values = zip(
        (reference.theta, reference.theta_dot, reference.theta_ddot), reference.sample(once), strict=True
    )
    sampled = (np.insert(array, at, value[0], axis=0) for array, value in values)
    with_jumps = None if before is None else np.insert(before, at, reference.before(once)[0], axis=0)
    return replace(Reference(np.insert(reference.t, at, t), *sampled), theta_ddot_before=with_jumps)


def describe_queued(under_way: Reference | None, after: Reference, t: float | None, dt: float) -> str:
    """Return in words that a reference waits for its begin while another one moves; else nothing.

    Args:
        under_way: What leads the axes; None when nothing does.
        after: What shall be followed next.
        t: Now [s]; None when nobody knows.
        dt: Control period [s].
    """
    if under_way is None or t is None or under_way.t[0] > t + 2.0 * dt:
        return ""
    begin, end = float(after.t[0]), float(under_way.t[-1])
    if min(begin, end) <= t + 2.0 * dt:
        return ""
    if end <= begin + dt:
        return f"the motion under way ends first, this one begins in {begin - t:.3g} s"
    return f"the motion under way is cut off when this one begins, in {begin - t:.3g} s"
