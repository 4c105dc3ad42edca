"""What a run of the chain in one process took, and whether it was led to its end."""

from __future__ import annotations

from dataclasses import dataclass

from flexarm_bringup.sim.hardware import Hardware
from flexarm_controller.command import ControlCommand
from flexarm_estimator.estimate import Estimate


@dataclass(frozen=True)
class Effort:
    """What a run took.

    Attributes:
        speed: Simulated seconds per second of CPU time from ``WARM_UP`` on, rig and record included [1].
        served: Models adopted on the way.
        adopt_time: CPU time of making and adopting them [s].
        unusable: Share of the periods in which the controller had no usable state or no plan [1].
        guard: Why the guard stopped the arm, and what the estimator said then; empty when it did not.
        is_led: Whether the law itself chose the torque, tick by tick, (n,).
        given_up: When and why the controller gave up what it followed, the first time; empty when it did not.
    """

    speed: float
    served: int
    adopt_time: float
    unusable: float
    guard: str
    is_led: tuple[bool, ...] = ()
    given_up: str = ""


class LoopWatch:
    """Watches a run as it goes.

    Attributes:
        is_led, guard, given_up: See ``Effort``.
    """

    def __init__(self, law: str) -> None:
        """Know the law that was asked for; nothing has happened yet."""
        self._law = law
        self.is_led: list[bool] = []
        self.guard = self.given_up = ""

    def note(self, command: ControlCommand, hardware: Hardware, estimate: Estimate) -> None:
        """Note a period: what the controller said of an estimate, and what became of it."""
        self.is_led.append(command.mode == self._law)
        self.guard = self.guard or stopped_by(hardware, estimate)
        if command.reference is None and not self.given_up:  # it has one from before the first period
            self.given_up = f"at {command.t:.3f} s: {command.reason}"

    def effort(self, speed: float, served: int, adopt_time: float) -> Effort:
        """Return what the run took; see ``Effort``."""
        unusable = self.is_led.count(False) / max(len(self.is_led), 1)
        return Effort(speed, served, adopt_time, unusable, self.guard, tuple(self.is_led), self.given_up)


def stopped_by(hardware: Hardware, estimate: Estimate) -> str:
    """Return why the guard has stopped the arm, and where that is no usable state, why there is none."""
    reason = hardware.guard.reason
    if not reason or estimate.is_usable:
        return reason
    return f"{reason}; the estimator says: {estimate.reason}"
