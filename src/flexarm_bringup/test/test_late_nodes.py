"""Who is not ready is told, less and less often."""

from __future__ import annotations

from flexarm_bringup.rig_run.late_nodes import FIRST, LateNodes

READY, WAITING = {"model": True, "estimator": True}, {"model": True, "estimator": False}


def told(states: dict[int, dict[str, bool]], seconds: int) -> dict[int, str]:
    """Return what is said at which second; ``states`` tells from when who is ready."""
    late, state, said = LateNodes(), WAITING, {}
    for t in range(seconds):
        state = states.get(t, state)
        if words := late.look(float(t), state):
            said[t] = words
    return said


def test_a_node_that_never_becomes_ready_is_named_at_doubling_times() -> None:
    first = round(FIRST)
    assert told({}, 5 * first) == {
        wait: f"not ready after {wait} s: estimator" for wait in (first, 2 * first, 4 * first)
    }


def test_nodes_that_become_ready_in_time_are_not_named() -> None:
    assert told({5: READY}, 100) == {}


def test_a_node_that_returns_has_its_time_again() -> None:
    first = round(FIRST)
    assert [*told({5: READY, 50: WAITING, 60: READY, 70: WAITING}, 70 + first + 1)] == [70 + first]
