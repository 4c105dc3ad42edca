"""Commands keep their distance in time."""

import pytest

from flexarm_controller.pacing import Pacing


def test_a_command_waits_for_half_a_period_after_a_late_one():
    now = [0.0]
    pacing = Pacing(0.005, lambda: now[0])
    assert pacing.wait() == 0.0
    now[0] = 1.0
    pacing.note()
    now[0] = 1.0005
    assert 0.0020 <= pacing.wait() == pytest.approx(0.00225)
    now[0] = 1.003
    assert pacing.wait() == 0.0
