"""Who is not ready is told, less and less often."""

from __future__ import annotations

from flexarm_bringup.rig_run.late_nodes import FIRST, Complaints, LateNodes

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


def test_what_a_late_node_complains_of_is_told_until_it_is_well() -> None:
    """That an arm has no mode to watch stood in a log, once; the console said that it was not ready."""
    said, late = Complaints(), LateNodes()
    said.hear("drift: watch", "model refused: no mode", is_well=False)
    said.hear("model: motion", "none", is_well=False)
    late.look(0.0, {"model": True, "drift": False, "rig": False}, said.of)
    told = late.look(FIRST, {"model": True, "drift": False, "rig": False}, said.of)
    assert told == f"not ready after {FIRST:.0f} s: drift (model refused: no mode), rig"
    said.hear("drift: watch", "", is_well=True)
    assert not said.of("drift") and said.of("model") == "none"
