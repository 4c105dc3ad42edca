"""What the controller knows of the guard: session, and how long it has been silent."""

from __future__ import annotations

import pytest
from flexarm_interfaces.msg import GuardStatus

from flexarm_controller.guard_session import GuardSession

SECOND = 10**9


def told_at(session, *seconds):
    for at in seconds:
        session.note(round(at * SECOND))
    return session.fault


def test_commands_are_counted_anew_only_in_another_session():
    session = GuardSession(0.005)
    assert session.fault == "guard is not armed"
    assert session.hear(GuardStatus(session_token=7))
    session.sequence = 12
    assert not session.hear(GuardStatus(session_token=7))
    assert (session.token, session.sequence, session.fault) == (7, 12, "")
    assert session.hear(GuardStatus(reason="too fast"))
    assert (session.token, session.sequence, session.stopped_by) == (0, 0, "too fast")


@pytest.mark.parametrize(("period", "bearable"), [(0.005, 0.5), (0.001, 0.5), (0.05, 5.0), (None, 1e6)])
def test_five_messages_may_stay_away(period, bearable):
    session = GuardSession(period)
    session.hear(GuardStatus(session_token=7))
    steps = [3.0 + bearable * k / 10 for k in range(11)]
    assert told_at(session, *steps) == ""
    assert ("said nothing" in told_at(session, 3.001 + bearable)) == (period is not None)
    session.hear(GuardStatus(session_token=7))  # it was the network
    assert session.fault == ""


def test_a_clock_that_jumps_is_no_silence():
    session = GuardSession(0.005)
    session.hear(GuardStatus(session_token=7))
    assert told_at(session, 1.0, 1.1, 6.1, 3606.1, 2.0, 2.1, 2.4) == ""
    assert "0.53 s" in told_at(session, 2.43)
