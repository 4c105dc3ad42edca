"""What leads the axes: one reference after the other, without a jump, whatever begins later waiting its turn.

A reference that begins while another is under way takes over when it begins; until then, or until it ends,
the one under way is followed. The newest is right from its begin on: what was to begin later than that is
gone. Laws that look ahead see what is followed as one reference. One whose way from where the axes are leads
beyond the limits is not taken.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.limits import Limits
from flexarm_controller.reference import Reference, hold, splice, with_rests
from flexarm_controller.reference_jump import without_jump

Array = NDArray[np.float64]
NEXT = 1.5  # periods; what begins sooner begins with the next state
DIP, HURRY = 4.0 / 27.0, 4.0 / 3.0  # of its way in a period and of its velocity: a cubic from rest to moving


class ReferenceQueue:
    """Joins references.

    Attributes:
        reference: What is followed, or shall be when the axes are led; None when nothing is.
        is_led: The axes are led by it.
    """

    def __init__(self, limits: Limits, dt: float, names: Sequence[str] = ()) -> None:
        """Start empty.

        Args:
            limits: Of the arm.
            dt: Control period [s].
            names: Of the axes, "joint.axis"; numbers where not given.
        """
        self._limits, self._dt, self._names = limits, dt, names
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

    def lead(self, theta: Array, t: float) -> str:
        """Begin at ``t`` [s] to lead axes that are at ``theta`` [rad] or [m], (n_theta,).

        Returns:
            Why they are held there instead; empty when they are led.
        """
        reference, self.is_led = self._without_jump(theta, self.reference or hold(theta, t), t), True
        if reference is not self.reference and (fault := self._fault(reference, theta)):
            self.clear()
            self.reference, self.is_led = hold(theta, t), True
            return fault
        self.reference = reference
        return ""

    def take(self, reference: Reference, t: float) -> str:
        """Let a reference follow on what leads the axes at ``t`` [s]; where none does, on no other.

        Returns:
            Why it is not taken; empty when it is.
        """
        before = self.reference
        if before is None or not self.is_led:
            self.reference, self._begin = reference, float(reference.t[0])
            return ""
        meet = min(float(before.t[-1]), float(reference.t[0]))
        meet = meet if meet > t + NEXT * self._dt else t
        theta = before.position(meet)
        after = self._without_jump(theta, reference, meet)
        if after is not reference and (fault := self._fault(after, theta)):
            return fault
        self._begin = float(reference.t[0])
        begin = float(after.t[0])
        self._former = [(part, until) for part, until in self._former if t < until < begin]
        if begin > t:
            self._former.append((before, begin))
        if meet > t:
            after = splice(_with_sample(with_rests(before, t, begin), begin - self._dt), after, t)
        self.reference = after
        return ""

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
        return without_jump(theta, reference, t, self._limits.velocity, self._dt)

    def _fault(self, led: Reference, theta: Array) -> str:
        """Return why the way from ``theta``, (n_theta,), cannot be gone; empty when it can.

        As it is sampled once a period, a reference that begins moving is off by one cubic. Axes may be led
        back from beyond their range.
        """
        low = np.minimum(self._limits.position_low, theta)
        limits = replace(
            self._limits, position_low=low, position_high=np.maximum(self._limits.position_high, theta)
        )
        dip = DIP * limits.velocity * self._dt
        bearable = replace(
            limits,
            velocity=HURRY * limits.velocity,
            position_low=low - dip,
            position_high=limits.position_high + dip,
        )
        if not led.fault(bearable, self._names):
            return ""
        return f"on the way to it from where the axes are led: {led.fault(limits, self._names)}"


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
