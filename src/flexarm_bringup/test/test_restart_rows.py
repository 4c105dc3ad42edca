"""Row 45 finds a controller whose law takes over before the estimate is sure."""

from __future__ import annotations

import pytest

from flexarm_bringup.fault_drill.drill import stand_of
from flexarm_bringup.fault_drill.restart_rows import restarts
from flexarm_controller.trust import Trust

pytestmark = pytest.mark.slow


def test_a_law_that_does_not_wait_for_a_sure_estimate_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Trust, "fault", lambda self, sigma, scale: "")
    missed = [finding for finding in restarts(stand_of("single_link", "controller")) if not finding.passed]
    assert "estimator: of these under the law" in [finding.what for finding in missed]
