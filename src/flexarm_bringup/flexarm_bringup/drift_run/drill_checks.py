"""What a drill of the watch has to keep: soon, with the right numbers, the right sign and the right advice.

All frequencies of the arm change by one share, and the drill knows it: what is called known at the end has to
be that share, within what the watch says of its own uncertainty.
"""

from __future__ import annotations

from flexarm_bringup.drift_run.simulation import Drill, Watched
from flexarm_bringup.page.check import Check
from flexarm_estimator.drift.judgement import ModeNow
from flexarm_estimator.drift.proposal import ALL_ALIKE, TOO_EARLY
from flexarm_estimator.drift.settings import DriftConfig

SOON, PER_HOUR = 10.0, 1.0  # s until a change is told at most; false alarms per hour at most
SIGMAS, ROUGHLY = 4.0, 0.01  # of a known change at most, and by how much it may be off for all its sigma [1]
PERCENT = 100.0


def drill_checks(watched: Watched, drill: Drill, settings: DriftConfig) -> list[Check]:
    """Return the bounds of a drill.

    Args:
        watched: What the watch said.
        drill: What happened.
        settings: Of the watch.
    """
    if watched.guard:
        return [Check("the arm moved on", "no stop", watched.guard, False)]
    if drill.scale == 1.0:
        return [_false_alarms(watched, drill, settings)]
    after = [when - drill.at for when, _ in watched.alarms if when >= drill.at]
    early = len(watched.alarms) - len(after)
    found = f"{after[0]:.1f} s" if after else "never"
    return [
        Check("told after the change", f"within {SOON:g} s", found, bool(after) and after[0] <= SOON),
        Check("told before it", "never", f"{early} times", not early),
        _signs(watched, drill, settings),
        _known(watched, drill, settings),
        _advice(watched),
    ]


def is_unjudged(watched: Watched, settings: DriftConfig) -> bool:
    """Return whether no mode was ever compared with how the healthy arm reads."""
    last = watched.modes[-1] if watched.modes else ()
    return bool(settings.learning) and not any(mode.healthy for mode in last)


def _false_alarms(watched: Watched, drill: Drill, settings: DriftConfig) -> Check:
    count, hours = len(watched.alarms), drill.duration / 3600
    wanted, found = f"under {PER_HOUR:g} per hour", f"{count} in {hours:.2f} h"
    if not count and is_unjudged(watched, settings):
        return Check("false alarms", wanted, found, False, excuse="no mode was judged")
    return Check("false alarms", wanted, found, count < max(PER_HOUR * hours, 1.0))


def _signs(watched: Watched, drill: Drill, settings: DriftConfig) -> Check:
    """Check that frequencies told to have changed went where the drill sent them."""
    told = [mode for mode in watched.told if abs(mode.drift) >= settings.frequency_change]
    wrong = [mode for mode in told if (mode.drift > 0.0) != (drill.scale > 1.0)]
    said = ", ".join(f"{mode.name.replace('_', ' ')} {PERCENT * mode.drift:+.1f} %" for mode in wrong)
    return Check("told the wrong way", "never", said or "never", not wrong)


def _known(watched: Watched, drill: Drill, settings: DriftConfig) -> Check:
    """Check the numbers of the modes that are judged and known at the end."""
    last = watched.modes[-1] if watched.modes else ()
    known = [mode for mode in last if mode.is_certain and (mode.healthy or not settings.learning)]
    wanted = f"{PERCENT * (drill.scale - 1.0):+.4g} % to {PERCENT * ROUGHLY:g} % or {SIGMAS:g} sigma"
    if not known:
        return Check(
            "known changes", wanted, "none is known", False, excuse="no frequency is known at the end"
        )
    worst = max(known, key=lambda mode: _error(mode, drill) / _allowed(mode))
    found = (
        f"{PERCENT * worst.drift:+.2f} ± {PERCENT * worst.drift_sigma:.2f} % ({worst.name.replace('_', ' ')})"
    )
    return Check("known changes", wanted, found, _error(worst, drill) <= _allowed(worst))


def _error(mode: ModeNow, drill: Drill) -> float:
    return abs(1.0 + mode.drift - drill.scale)


def _allowed(mode: ModeNow) -> float:
    return max(ROUGHLY, SIGMAS * mode.drift_sigma)


def _advice(watched: Watched) -> Check:
    """Check that modes which changed by one share are said to have."""
    found = watched.proposal.split(";")[0].split(":")[0] or "nothing"
    excuse = "a mode is not within reach yet" if watched.proposal.startswith(TOO_EARLY) else ""
    return Check("proposal", f"{ALL_ALIKE} ...", found, watched.proposal.startswith(ALL_ALIKE), excuse=excuse)
