"""At the end of a recording the topics are named on which nothing came."""

from flexarm_bringup.bags.unheard import unheard
from flexarm_bringup.topics import streams

TABLE = streams(["tip"], ["pose"])


def test_sensors_of_the_arm_on_whose_topics_nothing_came_are_named() -> None:
    counts = {"/flexarm/joint_states": 7, "/flexarm/imu/tip": 0}
    assert unheard(TABLE, counts, ("rig",), ("joint_states", "strain", "imu/tip")) == ["strain", "imu/tip"]


def test_nothing_is_asked_of_nodes_that_take_no_part_or_of_what_a_run_may_do_without() -> None:
    counts = {"/flexarm/joint_states": 7}
    assert unheard(TABLE, counts, ("rig",), ("joint_states",)) == []
    assert unheard(TABLE, counts, ("rig", "guard"), ("joint_states", "applied_effort")) == [
        "applied_effort",
        "guard_status",
    ]
