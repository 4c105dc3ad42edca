"""The guard: the last code before the motors, small, deliberately simple, the standard library alone.

It lets a command pass only while it is armed, and only one that is fresh, finite, of the right length, from
this session and of the model that is served; it cuts torque and its rate to the limits. One period without a
command keeps the last torque; then it fades to what holds the arm, reached after 50 ms. A command that cannot
be meant, 50 ms of silence, positions and velocities that cannot both be true, an axis too fast for the end of
its range or for any place, a strain beyond its limit, or motors that put in too much energy latch a stop: the
arm is braked to rest and held there, until somebody arms the guard. Where braking is in vain it gives up, and
leaves the arm to the drives and their brakes. All time comes from the caller.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from flexarm_controller.guarding import checks
from flexarm_controller.guarding.arm_brake import ArmBrake
from flexarm_controller.guarding.energy import EnergyWindow
from flexarm_controller.guarding.joint_range import JointRange
from flexarm_controller.guarding.limits import Braking, GuardLimits
from flexarm_controller.guarding.loads import Loads
from flexarm_controller.guarding.messages import GuardCommand, GuardState
from flexarm_controller.guarding.onward import Onward
from flexarm_controller.guarding.plausibility import Plausibility
from flexarm_controller.guarding.rest_watch import RestWatch

__all__ = ["Braking", "Guard", "GuardCommand", "GuardLimits", "GuardState", "JointRange", "Loads"]

STOPPED, ARMED, BRAKING = "stopped", "armed", "braking"
NOT_ARMED_YET = "not armed yet"


class Guard:
    """Decides the torque of every motor period.

    Attributes:
        mode: "stopped", "armed" or "braking".
        reason: What stopped it; empty while armed.
        refusal: Why the last command that did not pass was refused; empty since one has passed.
        token: Session that commands must quote; 0 when not armed.
        model_id: Model that commands must be computed with; empty for any.
        passed, limited, refused: Commands let through, of these changed by a limit, and not let through [1].
        ticks: Motor periods [1].
        ticks_without_command: Periods while armed, after the first command, without a fresh one [1].
        age: Age of the command in use [s]; -1 when there is none.
        energy: That the motors have put in over the last ``limits.energy_window`` [J].
        holding: Torque that holds the arm where it is [N m] or [N].
        has_given_up: Braking was in vain: until the arm rests there is nothing but what holds it.
    """

    def __init__(self, limits: GuardLimits) -> None:
        """Start stopped; the motors bear the arm, as its first torque is to."""
        self.limits = limits
        self.mode, self.reason, self.refusal = STOPPED, NOT_ARMED_YET, ""
        self.token, self.model_id = 0, ""
        self.passed = self.limited = self.refused = 0
        self.ticks = self.ticks_without_command = 0
        self.age, self.energy = -1.0, 0.0
        self._brakes, self.has_given_up = ArmBrake(limits), False
        self._sequence, self._used = -1, -math.inf  # of the newest command let through
        self._deadline, self._silent, self._t = 0.0, 0, -math.inf
        self._before, self._since = "", math.inf  # model served before, and when it was replaced
        self._loads, self._window = limits.loads, EnergyWindow(limits.energy_window, limits.period)
        self._tau = self.holding = limits.borne(limits.loads.holding)
        self._low, self._high = [-e for e in limits.effort], list(limits.effort)
        self._reach = [rate * limits.period for rate in limits.effort_rate]  # of a torque in a period
        self._rest = RestWatch(len(limits.effort), limits.period, limits.rest_velocity, limits.label)
        self._plausibility, self._onward = Plausibility(limits), Onward(limits)

    @property
    def has_watched(self) -> bool:
        """Whether it has been told for long enough how the arm moves, also before the last stop."""
        return self.mode != STOPPED or self._rest.is_full

    @property
    def leaves_drives(self) -> bool:
        """Whether the drives are to be left to themselves: it has given up and taken its torque back."""
        return self.has_given_up and self._tau == self.holding

    def unready(self, must_know: bool = False) -> str:
        """Return why it cannot be armed now; empty when it can, or is.

        Args:
            must_know: Time does not stand until it is armed: it has to have watched the arm for long enough.
        """
        if self.mode == BRAKING:
            return f"still braking: {self.reason}"
        if must_know and not self.has_watched:
            return self._rest.judge() or "drives have not told for long enough how the arm moves"
        return (self._plausibility.fault or self._rest.judge()) if self.mode == STOPPED else ""

    def arm(self, t: float, token: int) -> bool:
        """Let commands pass that quote ``token``, or the session that is armed already go on.

        Returns:
            False while it is ``unready``, and for token 0, which means "not armed".
        """
        if self.mode == ARMED:
            return True
        if token == 0 or self.unready():
            return False
        self.mode, self.reason, self.refusal, self.token = ARMED, "", "", token
        self._sequence, self._used, self._deadline = -1, -math.inf, t + self.limits.arming_time
        self._t = -math.inf  # another clock may drive it now
        self._plausibility.trust()
        self._brakes.begin_anew()
        return True

    def stop(self, reason: str) -> None:
        """Latch a stop."""
        if self.mode == ARMED:
            self.mode, self.reason, self.token = BRAKING, reason, 0
            self._rest.forget()

    def release(self, reason: str) -> None:
        """Latch a stop because the drives obey no more; the arm is to be held where they leave it."""
        self.stop(reason)
        self._brakes.begin_anew()

    def serve(self, model_id: str, t: float) -> None:
        """Note which model is served from now on; commands of the one before pass for a while."""
        if model_id != self.model_id:
            self._before, self._since = self.model_id, t if self.model_id else math.inf
            self.model_id = model_id

    def carry(self, loads: Loads) -> None:
        """Take what the arm asks of its motors where it is now; loads of another arm are not taken."""
        if loads.fits(len(self._tau)):
            self._loads = loads

    def step(self, command: GuardCommand | None, state: GuardState, t: float) -> list[float]:
        """Return the torque for the period that starts at ``t``.

        Args:
            command: The newest command if one has arrived since the last step.
            state: What drives and gauges measure.
            t: Now [s].

        Returns:
            Torque [N m] or force [N] per axis, always finite and within the limits.
        """
        self.ticks += 1
        state = self._plausibility.look(state, t)
        if self._plausibility.has_switched:
            self._brakes.begin_anew()
        self.energy = self._window.add(self._tau, state.velocity)
        self._rest.add(state.velocity)
        self.holding = self.limits.borne(self._loads.holding_at(state.position))
        self._gained = self._onward.gained(self._tau, self._loads, self.holding)
        self._set_bounds(state)
        passed = self.passed
        wanted = self._follow(command, state, t) or self._brake(state)
        self._tau = [self._limit(axis, value) for axis, value in enumerate(wanted)]
        self.limited += self.passed > passed and self._tau != list(wanted)
        self._t = t
        self.age = t - self._used if self.mode == ARMED and math.isfinite(self._used) else -1.0
        return list(self._tau)

    def _follow(self, command: GuardCommand | None, state: GuardState, t: float) -> Sequence[float]:
        """Return the torque to follow; nothing unless armed and commanded, or after a stop."""
        if self.mode == ARMED and (fault := self._fault(command, state, t)):
            self.stop(fault)
        if command is not None:
            self.refusal = self._refuse(command, t)
            self.refused += bool(self.refusal)
            if not self.refusal:
                return self._pass(command)
        return self._bridge(t) if self.mode == ARMED else ()

    def _fault(self, command: GuardCommand | None, state: GuardState, t: float) -> str:
        """Return why the arm has to be stopped; empty when it has not."""
        meant = command if command is not None and command.token == self.token else None
        return (
            (checks.unusable(meant.effort, len(self.limits.effort)) if meant else "")
            or checks.went_back(t, self._t)
            or self._plausibility.fault
            or checks.too_fast(state, self.limits, self._gained)
            or checks.over_speed(state.velocity, self.limits)
            or checks.overstrained(state.strain, self.limits)
            or checks.too_much_energy(self.energy, self.limits)
        )

    def _refuse(self, command: GuardCommand, t: float) -> str:
        """Return why a command must not pass; empty when it may."""
        if self.mode != ARMED:
            return "guard is not armed"
        if command.token != self.token:
            return "command of another session"
        if not (command.sequence > self._sequence and command.t > self._used):
            return f"command {command.sequence} is not newer than {self._sequence}"
        if fault := checks.mistimed(command, t, self.limits):
            return fault
        if self.model_id not in ("", command.model_id) and not (
            command.model_id == self._before and 0.0 <= t - self._since <= self.limits.changeover
        ):
            return f"command computed with model '{command.model_id}', served is '{self.model_id}'"
        return ""

    def _pass(self, command: GuardCommand) -> Sequence[float]:
        """Take a command and return its torque."""
        self._sequence, self._used = command.sequence, command.t
        self._deadline, self._silent, self.passed = command.t + self.limits.max_age, 0, self.passed + 1
        self._brakes.begin_anew()
        return command.effort

    def _bridge(self, t: float) -> Sequence[float]:
        """Return the torque of a period without a command; nothing before the first one, or after a stop."""
        self.ticks_without_command += math.isfinite(self._used)
        if not t <= self._deadline + checks.ROUNDED * self.limits.period:  # also when t is not a number
            first, usual = f"within {self.limits.arming_time:g} s of arming", 1e3 * self.limits.max_age
            waited = f"for {usual:.0f} ms" if math.isfinite(self._used) else first
            self.stop("; refused: ".join(filter(None, (f"no command {waited}", self.refusal))))
            return ()
        if not math.isfinite(self._used):
            return ()
        self._silent += 1
        left = max(0.0, self._deadline - t)
        fading = left / (left + self.limits.period) if self._silent > checks.BRIDGED else 1.0
        return [h + fading * (tau - h) for tau, h in zip(self._tau, self.holding, strict=True)]

    def _brake(self, state: GuardState) -> Sequence[float]:
        """Return the torque that brings the arm to rest and holds it there."""
        if self.mode == BRAKING and self._rest.is_full and not self._rest.judge():
            self.mode, self.has_given_up = STOPPED, False
        beyond = [tau - h for tau, h in zip(self._tau, self.holding, strict=True)]
        if not self.has_given_up and (fault := self._brakes.fails(beyond, state.velocity)):
            self.mode, self.reason, self.has_given_up = BRAKING, f"{fault} (before: {self.reason})", True
            self._rest.forget()
        return self.holding if self.has_given_up else self._brakes.torque(state, self._loads, self.holding)

    def _set_bounds(self, state: GuardState) -> None:
        """Bound the torque; what pushes an axis out of its range fades where it may not move on."""
        for i, (q, known) in enumerate(zip(state.position, self.limits.ranges, strict=False)):
            most, held = self.limits.effort[i], self.holding[i]
            self._low[i] = held - known.share(q - known.low) * (held + most)
            self._high[i] = held + known.share(known.high - q) * (most - held)

    def _limit(self, axis: int, value: float) -> float:
        """Return ``value`` within the torque limit and within reach of the last torque."""
        low, high = self._tau[axis] - self._reach[axis], self._tau[axis] + self._reach[axis]
        inside, bound = max(self._low[axis], min(self._high[axis], value)), self.limits.effort[axis]
        return max(-bound, min(bound, max(low, min(high, inside))))
