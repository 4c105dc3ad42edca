"""What the guard is told: commands, and what the drives and gauges measure."""

from __future__ import annotations

import math
from typing import NamedTuple


class GuardCommand(NamedTuple):  # not a dataclass: made in every period, in a third of the time
    """A command as it arrived.

    Attributes:
        t: Stamp of the state it was computed from [s].
        sequence: Grows with every command of a session.
        token: Session it belongs to.
        effort: Torque [N m] or force [N] per axis.
        model_id: Model it was computed with.
        acts_at: Begin of the period that it is meant for [s]; -inf: the next one.
    """

    t: float
    sequence: int
    token: int
    effort: tuple[float, ...]
    model_id: str = ""
    acts_at: float = -math.inf


class GuardState(NamedTuple):  # likewise
    """What drives and gauges measure.

    Attributes:
        velocity: Of the axes [rad/s] or [m/s].
        position: Of the axes [rad] or [m].
        strain: At every gauge that has a limit, NaN where it is silent; empty when none speaks [1].
    """

    velocity: tuple[float, ...]
    position: tuple[float, ...] = ()
    strain: tuple[float, ...] = ()
