"""What is known of a running rig at one instant: the numbers of one frame of the monitor, without ROS."""

from __future__ import annotations

import math
from dataclasses import dataclass

from flexarm_model.settings.diagnosis import Level, Verdict

UNKNOWN = math.nan
SILENT = 1.0  # s; a topic or a node that said nothing for so long is told as silent


@dataclass(frozen=True)
class ModeRow:
    """One elastic mode of the served model.

    Attributes:
        name: Of the mode.
        f_hz, zeta: Frequency [Hz] and damping ratio [1].
        at_tip: What its amplitude moves the tip by [m].
        sigma: One sigma of that [m].
        largest: Largest amplitude seen [m].
    """

    name: str
    f_hz: float
    zeta: float
    at_tip: float = UNKNOWN
    sigma: float = UNKNOWN
    largest: float = 0.0


@dataclass(frozen=True)
class AxisRow:
    """One actuated axis.

    Attributes:
        name: "joint.axis".
        position: [rad] or [m].
        error: Reference minus estimate, in the same unit.
        effort: Torque [N m] or force [N] that the guard let through.
        limit: Largest allowed; infinite when it is not known.
        is_linear: Metres and newtons.
    """

    name: str
    position: float = UNKNOWN
    error: float = UNKNOWN
    effort: float = UNKNOWN
    limit: float = math.inf
    is_linear: bool = False


@dataclass(frozen=True)
class SensorRow:
    """One sensor, as the estimator sees it; ``age`` [s], ``innovation`` normalised [1]."""

    name: str
    status: str
    reason: str
    age: float
    innovation: float
    rejected: int


@dataclass(frozen=True)
class TopicRow:
    """Arrivals of one topic over the last seconds: rate [Hz], jitter, longest gap and age [s]."""

    name: str
    rate_hz: float
    jitter: float
    longest: float
    age: float


@dataclass(frozen=True)
class GuardRow:
    """What the guard says; ``age`` is that of the command in use [s], ``said`` that of the status [s]."""

    mode: str
    reason: str
    age: float
    passed: int
    limited: int
    refused: int
    late: int
    without_command: int
    said: float


@dataclass(frozen=True)
class ControllerRow:
    """What the controller says; ``solve_time`` [s]."""

    mode: str
    reason: str
    solve_time: float
    missed: int
    overruns: int
    active: tuple[str, ...]


@dataclass(frozen=True)
class TipRow:
    """The tip: position [m] and three sigma of it [m], (3,); distances [m] are NaN where they are not known.

    Attributes:
        position: Estimated.
        three_sigma: Of the estimate.
        error: Distance of the estimate from the truth; a simulated rig alone knows it.
        to_goal: Distance from the goal of a motion.
    """

    position: tuple[float, float, float]
    three_sigma: tuple[float, float, float]
    error: float = UNKNOWN
    to_goal: float = UNKNOWN


@dataclass(frozen=True)
class Picture:
    """Everything of one instant; what nobody has said yet is None or empty.

    Attributes:
        title: Manipulator and preset.
        model_id: Of the served model.
        foreign: That a description which was named is of another arm; empty when it is not.
        estimate: Status of the estimate and its reason.
        verdicts: Of /diagnostics, by node.
        domain: ROS domain.
    """

    title: str = ""
    model_id: str = ""
    foreign: str = ""
    domain: str = "0"
    estimate: tuple[str, str] | None = None
    guard: GuardRow | None = None
    controller: ControllerRow | None = None
    tip: TipRow | None = None
    modes: tuple[ModeRow, ...] = ()
    axes: tuple[AxisRow, ...] = ()
    sensors: tuple[SensorRow, ...] = ()
    topics: tuple[TopicRow, ...] = ()
    verdicts: tuple[Verdict, ...] = ()

    @property
    def is_complete(self) -> bool:
        """Whether every node has spoken."""
        return bool(self.model_id) and None not in (self.estimate, self.guard, self.controller, self.tip)

    @property
    def heard(self) -> tuple[TopicRow, ...]:
        """The topics that have spoken."""
        return tuple(row for row in self.topics if math.isfinite(row.age))

    def said(self, topic: str) -> float:
        """Return how long ago a topic spoke [s]; zero where that is not known."""
        return next((row.age for row in self.heard if row.name == topic), 0.0)

    def troubles(self) -> list[Verdict]:
        """Return the verdicts that are not OK, the worst first."""
        return sorted((v for v in self.verdicts if v.level != Level.OK), key=lambda v: -v.level)
