"""What drives an arm in a recorded bag: what the guard told, else what the drives measured."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from flexarm_bringup.consistency.acting_torques import acting_torques
from flexarm_bringup.consistency.bag_epochs import read_epochs
from flexarm_bringup.consistency.recording import Recording, open_recording
from flexarm_estimator.messages.inbox import TORQUE_TOPIC

GOLDEN = Path(__file__).parents[3] / "tests" / "golden"


def acting(told: dict[int, float], measured: dict[int, float | None]) -> list[tuple[int, float]]:
    """Return stamps [ns] and torques [N m] of one axis of 10 N m."""
    began = acting_torques(
        {stamp: np.array([tau]) for stamp, tau in told.items()},
        {stamp: None if tau is None else np.array([tau]) for stamp, tau in measured.items()},
        [10.0],
    )
    return [(torque.stamp_ns, torque.tau.item()) for torque in began]


def test_what_the_guard_tells_acts_from_its_stamp_on() -> None:
    assert acting({20: 2.0, 10: 1.0, 30: 2.0}, {}) == [(10, 1.0), (20, 2.0)]
    assert acting({}, {}) == []


def test_without_a_guard_what_the_drives_measure_acted_up_to_its_stamp() -> None:
    assert acting({}, {10: 1.0, 20: 2.0, 30: None, 40: 3.0}) == [(0, 1.0), (10, 2.0), (30, 3.0)]


def test_where_the_drives_measure_another_torque_than_was_told_they_are_right() -> None:
    """Within 0.05 of the axis' 10 N m it is noise of what they measure."""
    assert acting({10: 1.0, 20: 2.0}, {20: 1.4, 30: 2.4}) == [(10, 1.0), (20, 2.0)]
    assert acting({10: 1.0, 20: 2.0}, {20: 1.4, 30: 7.0}) == [(10, 1.0), (20, 7.0)]


def test_a_bag_without_a_guard_is_driven_by_what_its_drives_measured() -> None:
    """Its arm was taken to move without any torque."""
    recording = open_recording(GOLDEN / "single_link" / "bag")
    with_guard, without = (
        np.array([epoch.u for epoch in read_epochs(each).epochs])
        for each in (recording, _without_guard(recording))
    )
    assert abs(with_guard[:, 0]).max() > 0.1  # N m
    np.testing.assert_array_equal(without[1:], with_guard[1:])


def _without_guard(recording: Recording) -> Recording:
    kept = tuple(record for record in recording.bag.records if not record.name.endswith(TORQUE_TOPIC))
    assert len(kept) < len(recording.bag.records)
    return replace(recording, bag=replace(recording.bag, records=kept))
