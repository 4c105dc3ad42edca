"""How far a goal has got: on its way, settling, at its end."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.reference import Reference

Array = NDArray[np.float64]
Stage = Literal["accepted", "executing", "succeeded", "canceled", "rejected", "aborted"]
ROUNDING = 1e-9  # s
ON_REQUEST = "on request"  # why a goal is stopped that somebody has canceled
FINAL = ("succeeded", "canceled", "rejected", "aborted")


@dataclass(frozen=True)
class Progress:
    """What is told of a goal.

    Attributes:
        t: Of the newest state [s].
        goal_id: Which goal; 0: none.
        stage: Where it is.
        share: Of the motion's time that has passed, 0 ... 1.
        distance: Of the tip from the goal [m]; NaN where not known.
        is_settled: Whether that is near enough.
        reason: Why it ended otherwise than wanted.
    """

    t: float
    goal_id: int
    stage: Stage
    share: float = 0.0
    distance: float = float("nan")
    is_settled: bool = False
    reason: str = ""

    @property
    def is_final(self) -> bool:
        """Whether nothing more will be told of this goal."""
        return self.stage in FINAL


class Pursuit:
    """A goal that is being pursued, or a stop.

    Attributes:
        goal_id: Which goal; 0: the stop of a reference that was no goal.
        reference: What is followed for it.
        point: Where the tip comes to rest [m], (3,); None for a stop that knows no goal.
        stop: Why it is a stop; empty for a goal.
    """

    def __init__(  # noqa: PLR0913, the parts of one record
        self,
        goal_id: int,
        reference: Reference | None,
        start: float,
        end: float,
        point: Array | None,
        stop: str = "",
    ) -> None:
        """Begin; ``start`` and ``end`` of the motion in s."""
        self.goal_id, self.reference, self.point, self.stop = goal_id, reference, point, stop
        self._start, self._end = start, end
        self._told = -np.inf
        self._inside = np.inf  # since when the tip is near the goal

    def is_due(self, t: float, config: MotionConfig) -> bool:
        """Tell whether the tip has to be looked at: at its end always, before only to tell of it."""
        return t >= self._end or t - self._told >= 1.0 / config.motion_status_rate - ROUNDING

    def judge(self, t: float, distance: float, config: MotionConfig) -> Progress | None:
        """Return what there is to tell at ``t`` [s] with the tip that far from the goal [m], or nothing."""
        is_settled = distance <= config.settle_distance
        self._inside = min(self._inside, t) if is_settled and t >= self._end else np.inf
        if self.stop and t >= self._end:
            return self.end(t, "canceled" if self.stop == ON_REQUEST else "aborted", self.stop, distance)
        if not self.stop and t - self._inside >= config.settle_time:
            return Progress(t, self.goal_id, "succeeded", 1.0, distance, True)
        if not self.stop and t - self._end > config.settle_patience:
            is_known = np.isfinite(distance)
            unknown = "no usable state, or the model in use does not tell where the tip is"
            why = f"the tip stays {1e3 * distance:.3g} mm from the goal" if is_known else unknown
            return self.end(t, "aborted", why, distance)
        if t - self._told < 1.0 / config.motion_status_rate - ROUNDING:
            return None
        self._told = t
        return Progress(t, self.goal_id, "executing", self._share(t), distance, is_settled)

    def end(self, t: float, stage: Stage, reason: str, distance: float = float("nan")) -> Progress:
        """Return the last word on it."""
        return Progress(t, self.goal_id, stage, self._share(t), distance, False, reason)

    def _share(self, t: float) -> float:
        length = self._end - self._start
        return float(np.clip((t - self._start) / length, 0.0, 1.0)) if length > 0.0 else float(t >= self._end)
