"""Row 45 finds a controller whose law takes over before the estimate is sure."""

from __future__ import annotations

import pytest

from flexarm_bringup.fault_drill.drill import stand_of
from flexarm_bringup.fault_drill.restart_rows import restarts
from flexarm_controller.trust import Trust

pytestmark = pytest.mark.slow


def under_the_law() -> tuple[int, float]:
    """Return the unsure cycles of a new estimator of the 3RRR, and in how many of them the law acted."""
    found = next(f for f in restarts(stand_of("planar_3rrr", "controller")) if "under the law" in f.what)
    return int(found.what.split()[2]), found.measured


def test_a_new_estimator_in_one_process_is_trusted_when_it_is_sure() -> None:
    unsure, acted = under_the_law()
    assert unsure >= 5 and acted == 0


def test_a_law_that_does_not_see_a_new_estimator_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Trust, "follow", lambda self, t, age: None)
    unsure, acted = under_the_law()
    assert acted == unsure >= 5
