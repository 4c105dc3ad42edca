"""Lockstep hands over exactly what a tick announces, in order, whatever the order of arrival."""

import itertools
from typing import Any

from flexarm_model.ros.lockstep import Lockstep, Messages

TOPICS = ("joint_states", "strain", "camera/pose")


def collector() -> tuple[Lockstep, list[tuple[int, dict[str, Any]]]]:
    done: list[tuple[int, dict[str, Any]]] = []

    def on_complete(stamp_ns: int, messages: Messages) -> None:
        done.append((stamp_ns, {topic: list(values) for topic, values in messages.items()}))

    return Lockstep(TOPICS, on_complete), done


def test_any_order_of_arrival_gives_the_same_tick() -> None:
    events = ["tick", "a", "b", "c"]
    for order in itertools.permutations(events):
        lockstep, done = collector()
        for event in order:
            if event == "tick":
                lockstep.announce(0, 5, ["joint_states", "strain", "imu/tip"], [1, 2, 1])
            else:
                lockstep.add("joint_states" if event == "a" else "strain", event)
        strain = [event for event in order if event in "bc"]
        assert done == [(5, {"joint_states": ["a"], "strain": strain})]


def test_ticks_are_handed_over_one_by_one_in_order() -> None:
    lockstep, done = collector()
    for k in range(3):
        lockstep.announce(k, 10 * k, ["joint_states", "camera/pose"], [1, int(k == 1)])
        lockstep.add("joint_states", k)
    lockstep.add("camera/pose", "frame")
    assert [stamp for stamp, _ in done] == [0, 10, 20]
    assert [list(messages) for _, messages in done] == [
        ["joint_states"],
        ["joint_states", "camera/pose"],
        ["joint_states"],
    ]


def test_an_announced_count_of_zero_waits_for_nothing() -> None:
    lockstep, done = collector()
    lockstep.announce(0, 0, ["strain"], [0])
    assert done == [(0, {})]


def test_missing_names_what_the_oldest_tick_waits_for() -> None:
    lockstep, done = collector()
    lockstep.announce(0, 0, ["strain", "joint_states"], [3, 1])
    lockstep.add("strain", 1)
    assert lockstep.missing() == {"strain": 2, "joint_states": 1}
    assert done == []


def test_a_node_that_joins_late_drops_what_came_before_its_first_tick() -> None:
    lockstep, done = collector()
    for k in (40, 41):
        lockstep.add("joint_states", k)
    lockstep.announce(41, 410, ["joint_states"], [1])
    assert done == [(410, {"joint_states": [41]})]
    assert lockstep.discarded == 1


def test_a_restarted_rig_does_not_leave_an_old_tick_waiting() -> None:
    lockstep, done = collector()
    lockstep.announce(0, 0, ["strain"], [1])
    lockstep.add("strain", "old")
    lockstep.announce(1, 5, ["strain"], [1])  # its message never comes
    lockstep.announce(0, 0, ["strain"], [1])
    lockstep.add("strain", "new")
    assert done == [(0, {"strain": ["old"]}), (0, {"strain": ["new"]})]


def test_what_comes_after_the_last_tick_can_be_taken() -> None:
    lockstep, done = collector()
    lockstep.announce(0, 0, ["strain"], [1])
    for value in "abc":
        lockstep.add("strain", value)
    assert lockstep.take_rest() == {"strain": ["b", "c"]}
    assert lockstep.take_rest() == {}
    assert len(done) == 1


def test_a_tick_whose_counts_do_not_match_its_topics_is_not_taken() -> None:
    """It raised in whoever heard it, and one message on ``tick`` ended estimator, controller and guard."""
    lockstep, done = collector()
    lockstep.announce(0, 0, ["strain"], [1, 2])
    assert lockstep.missing() == {}
    lockstep.announce(0, 7, ["strain"], [0])
    assert done == [(7, {})]
