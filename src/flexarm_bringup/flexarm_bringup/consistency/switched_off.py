"""Sensors that a user switched off while a bag was recorded: what they said then is no sample of their noise.

What else a user did to the estimator would make two filters of one record; it is refused with its place.
"""

from __future__ import annotations

from collections.abc import Sequence

from flexarm_bringup.bags.bag_writer import BagError
from flexarm_estimator.interventions.intervention import Intervention
from flexarm_estimator.interventions.toggle_sensor import ToggleSensor
from flexarm_estimator.measurement import Measurement


def without_switched_off(
    samples: Sequence[Measurement], done: Sequence[tuple[float, Intervention]]
) -> list[Measurement]:
    """Return the samples of sensors that were on, with all of their channels.

    Args:
        samples: Of any sensor.
        done: What a user did, after which instant [s].
    """
    off: dict[str, list[tuple[float, bool]]] = {}
    channels: dict[str, set[str]] = {}
    is_whole: dict[str, bool] = {}
    for t, each in sorted(done, key=lambda item: item[0]):
        if not isinstance(each, ToggleSensor):
            continue
        left_out = channels.setdefault(each.sensor, set())
        if not each.channels:
            is_whole[each.sensor] = each.is_on
        elif each.is_on:
            left_out.difference_update(each.channels)
        else:
            left_out.update(each.channels)
        is_off = not is_whole.get(each.sensor, True) or bool(left_out)
        off.setdefault(each.sensor, []).append((t, is_off))
    return [sample for sample in samples if not _was_off(off.get(sample.sensor, ()), sample.t)]


def refuse_other_filters(done: Sequence[tuple[float, Intervention]], path: object, begin: float) -> None:
    """Raise BagError where a user did more than switch sensors; times count from ``begin`` [s]."""
    for t, each in done:
        if not isinstance(each, ToggleSensor):
            raise BagError(
                f"{path}: after {t - begin:.3f} s a user interfered with the estimator: {each.describe()}; "
                "expected a recording in which state and noise are the filter's own"
            )


def _was_off(switched: Sequence[tuple[float, bool]], t: float) -> bool:
    return next((is_off for since, is_off in reversed(switched) if since < t), False)
