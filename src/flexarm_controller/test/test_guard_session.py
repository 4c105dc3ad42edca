"""What the controller knows of the guard: session, and how long it has been silent."""

from __future__ import annotations

import pytest
from flexarm_interfaces.msg import GuardStatus

from flexarm_controller.guard_session import GuardSession

SECOND = 10**9


def test_commands_are_counted_anew_only_in_another_session():
    session = GuardSession(0.005)
    assert session.fault(0) == "guard is not armed"
    assert session.hear(GuardStatus(session_token=7), 0)
    session.sequence = 12
    assert not session.hear(GuardStatus(session_token=7), SECOND)  # after a silence, too
    assert (session.token, session.sequence, session.fault(SECOND)) == (7, 12, "")
    assert session.hear(GuardStatus(reason="too fast"), SECOND)
    assert (session.token, session.sequence, session.stopped_by) == (0, 0, "too fast")


@pytest.mark.parametrize(("period", "bearable"), [(0.005, 0.5), (0.001, 0.5), (0.05, 5.0), (None, 1e6)])
def test_five_messages_may_stay_away(period, bearable):
    session = GuardSession(period)
    session.hear(GuardStatus(session_token=7), 3 * SECOND)
    last_ns = 3 * SECOND + round(bearable * SECOND)
    assert session.fault(last_ns) == session.fault(None) == session.fault(0) == ""  # stamps may go back
    assert ("said nothing" in session.fault(last_ns + 1)) == (period is not None)


def test_a_guard_heard_before_the_first_state_is_silent_since_then():
    session = GuardSession(0.005)
    session.hear(GuardStatus(session_token=7), None)
    assert session.fault(10**18) == "" and session.fault(10**18 + 600_000_000) != ""
