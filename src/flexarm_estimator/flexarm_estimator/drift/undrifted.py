"""What is said of a mode without an alarm: that it runs as it should, or why that cannot be said.

An alarm asks for five sigma. What reads off by as much as is told, but is known to three, is no alarm and is
not well either: it runs as it should only where drift and two sigma together stay below what is told.
"""

from __future__ import annotations

from flexarm_estimator.drift.judgement import PERCENT, ModeNow
from flexarm_estimator.drift.settings import DriftConfig

SURE = 2.0  # sigma beyond which a drift is not looked for


def undrifted(mode: ModeNow, config: DriftConfig) -> str:
    """Return the sentence.

    Args:
        mode: As it runs.
        config: Settings of the watch.
    """
    if config.learning and mode.healthy is None:
        return "not judged: how it read at the start is not known"
    if not mode.is_known:
        return "has not moved enough to tell"
    reads = f"reads {PERCENT * mode.drift:+.1f} +- {PERCENT * mode.drift_sigma:.2g} %"
    if not mode.is_within_reach:
        return f"{reads}, out of reach of what can be told"
    if mode.is_certain and abs(mode.drift) + SURE * mode.drift_sigma < config.frequency_change:
        return "as described" if mode.healthy is None else "as at the start"
    return f"{reads}, not sure enough to tell"
