"""Bounds on late cycles of the guard, and what witnesses of the machine have seen beside them."""

from __future__ import annotations

from flexarm_bringup.page.check import Check
from flexarm_bringup.processes.late_cycles import LateCycles
from flexarm_bringup.processes.standstill import Witnesses


def late_checks(late: LateCycles, cycles: int, witnesses: Witnesses | None) -> list[Check]:
    """Return the bound on late cycles, and beside it on those that the machine did not cause.

    Args:
        late: Late cycles.
        cycles: All [1].
        witnesses: Of that time and the moments before it; None where there were none.
    """
    is_good = cycles > 0 and not late.total
    checks = [Check("guard cycles that were late", "none", f"{late.total} of {cycles}", is_good)]
    if witnesses is not None and witnesses.are_heard:
        own = late.total - late.during(witnesses.standstills)
        checks.append(
            Check("of these, while the machine itself ran", "none", f"{own}", cycles > 0 and not own)
        )
    return checks


def standstill_rows(witnesses: Witnesses | None, began: float, seconds: float) -> list[tuple[str, float]]:
    """Return what the witnesses have seen of the time watched, to be printed beside the checks.

    Args:
        witnesses: They saw the start of the nodes and their end, too; None where there were none.
        began: When the watch began [s], of the steady clock.
        seconds: How long it lasted [s].
    """
    if witnesses is None or not witnesses.are_heard:
        return []
    seen = [each for each in witnesses.standstills if each.end > began and each.start < began + seconds]
    longest = max((each.seconds for each in seen), default=0.0)
    return [
        ("standstills of a core of more than 2 ms", float(len(seen))),
        ("longest standstill of a core [ms]", 1e3 * longest),
    ]
