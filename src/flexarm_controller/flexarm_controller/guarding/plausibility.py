"""Whether what drives tell of an axis can be true: its way against the integral of its velocity.

Over a quarter of a second at most, from a position q_0 with velocity v_0 on,

    |q - q_0 - T sum v| <= noise + 2 delay max(|v|, |v_0|, step / T)

where ``step`` is the last one, but at most twice the one before: an axis that jumps is not fast. ``noise`` is
what encoders and an offset of the velocity make of it; a velocity that is late by ``delay`` makes
``delay |v - v_0|`` of it, v as it is and not as it is told, which at q_0 is judged by the step to it as well.
Where states were lost it begins anew, for nobody knows that way.

An axis that fails is doubted until the guard is armed again. A position that changes is believed, and its
velocity is that of the axis. Where it stands it may be frozen, and to brake an arm that stands is less bad
than to let one run on: the told velocity is believed until the position changes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from flexarm_controller.guarding.limits import GuardLimits
from flexarm_controller.guarding.messages import GuardState
from flexarm_controller.guarding.rest_watch import REST_TIME

UNTOLD = "drives do not tell position and velocity of every axis"
VELOCITY_SMOOTHING = 0.4  # share of the newest difference in a velocity, as the drives of the rig smooth
STANDS = 0.25  # of the velocity told: what moves slower by its position may stand there
SUDDEN = 2.0  # times the last step; what is more is a jump
LOST = 1.5  # periods between two states from which on one is missing


class Plausibility:
    """Compares positions and velocities of the axes.

    Attributes:
        fault: Which axis told what cannot be true, until all have been plausible for the whole time.
        has_switched: From this period on the velocity of an axis is that of its position.
    """

    def __init__(self, limits: GuardLimits) -> None:
        """Know nothing yet; without ``limits.noise`` everything is plausible."""
        self._noise, self._lag, self._period = limits.noise, 2.0 * limits.velocity_delay, limits.period
        self._least, self._lost = min(limits.noise, default=0.0), LOST * limits.period
        self._label = limits.label
        self._most = max(1, round(REST_TIME / limits.period))
        self._from: Sequence[float] = (0.0,) * len(limits.noise)  # q_0
        self._before = self._earlier = self._from  # the last two
        self._fastest = list(self._from)  # at the begin, as told or by the step
        self._off, self._count = list(self._from), 0  # q - q_0 - T sum v
        self._t, self.fault, self.has_switched = -math.inf, "", False
        self._own: dict[int, float] = {}  # velocity of the position of a doubted axis
        self._moved: set[int] = set()  # doubted axes whose position has changed

    def look(self, state: GuardState, t: float) -> GuardState:
        """Return the state with velocities that can be believed; called once a period, at ``t`` [s]."""
        if not self._noise:
            return state
        v, q, _ = state
        self.has_switched = False
        if not len(q) == len(v) == len(self._noise):
            self._t, self.fault = -math.inf, UNTOLD
            return state
        since, self._t = t - self._t, t
        if is_next := 0.0 < since < self._lost:
            axes, period = zip(self._off, q, self._before, v, strict=False), self._period
            self._off = [off + (at - before) - period * told for off, at, before, told in axes]
            self._count += 1
            if not math.hypot(*self._off) <= self._least or self._count == self._most:
                self._compare(q, v)
        else:
            self._before = self._earlier = q
            self._begin(q, v)
        if self._own:
            state = state._replace(velocity=self._believed(q, v, is_next))
        self._before, self._earlier = q, self._before
        return state

    def trust(self) -> None:
        """Believe all velocities again."""
        self._own.clear()
        self._moved.clear()

    def _begin(self, q: Sequence[float], v: Sequence[float]) -> None:
        """Begin to compare anew."""
        self._fastest = [max(self._step(axis, at), abs(v[axis])) for axis, at in enumerate(q)]
        self._from = q
        self._off, self._count = [0.0] * len(q), 0

    def _compare(self, q: Sequence[float], v: Sequence[float]) -> None:
        """Judge, and begin anew after the whole time, or with a new doubt."""
        fault = self._judge(q, v)
        if fault or self._count == self._most:
            self.fault = fault
            self._begin(q, v)

    def _judge(self, q: Sequence[float], v: Sequence[float]) -> str:
        """Doubt the axes whose difference is not that of a late velocity either; return the first of them."""
        found = []
        for axis, noise in enumerate(self._noise):
            way = q[axis] - self._from[axis]
            by_velocity = way - self._off[axis]
            late = self._lag * max(abs(v[axis]), self._fastest[axis], self._step(axis, q[axis]))
            if not abs(self._off[axis]) <= noise + late:
                label, after = self._label(axis), f"{1e3 * self._count * self._period:.0f} ms"
                told = label.position(by_velocity)
                found.append(f"{label.name} went {label.position(way)} in {after}, its velocity says {told}")
                step = (q[axis] - self._before[axis]) / self._period
                self._doubt(axis, step, by_velocity / self._count / self._period)
        return found[0] if found else ""

    def _step(self, axis: int, q: float) -> float:
        """Return how fast an axis is by its position; one that was slower by half the period before jumps."""
        before = self._before[axis]
        return min(abs(q - before), SUDDEN * abs(before - self._earlier[axis])) / self._period

    def _doubt(self, axis: int, step: float, told: float) -> None:
        """Begin to make a velocity of the position of an axis that went at ``step`` in the last period."""
        self._own.setdefault(axis, step if math.isfinite(step) else 0.0)
        if abs(step) > STANDS * abs(told):
            self._use_position(axis)

    def _use_position(self, axis: int) -> None:
        """Take the velocity of an axis from its position from now on."""
        self.has_switched |= axis not in self._moved
        self._moved.add(axis)

    def _believed(self, q: Sequence[float], v: Sequence[float], is_next: bool) -> tuple[float, ...]:
        """Return the velocities that can be believed; ``is_next``: no state between this and the last."""
        believed = list(v)
        for axis, own in self._own.items():
            step = (q[axis] - self._before[axis]) / self._period
            if is_next and math.isfinite(step):
                self._own[axis] = own + VELOCITY_SMOOTHING * (step - own)
            if abs(q[axis] - self._from[axis]) > self._noise[axis]:
                self._use_position(axis)
            if axis in self._moved or not math.isfinite(v[axis]):
                believed[axis] = self._own[axis]
        return tuple(believed)
