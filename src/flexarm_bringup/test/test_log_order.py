"""A recording of a lockstep run has the same order whatever the order of arrival."""

import struct

import numpy as np
import pytest

from flexarm_bringup.bags.cdr import header_frame_id
from flexarm_bringup.bags.log_order import HORIZON_NS, ArrivalLog, LockstepLog
from flexarm_bringup.topics import streams

STREAMS = {stream.topic: stream for stream in streams(["tip"])}
PERIOD_NS = 5_000_000
Written = list[tuple[str, int, bytes]]


def lockstep_log() -> tuple[LockstepLog, Written]:
    written: Written = []
    return LockstepLog(list(STREAMS.values()), lambda *item: written.append(item)), written


def send(log: LockstepLog, topic: str, k: int, delay: int = 0) -> None:
    """Send message ``k`` of a topic, stamped ``delay`` periods before its tick."""
    stamp_ns = (k - delay) * PERIOD_NS
    cdr = struct.pack("<4xiI", 0, stamp_ns).replace(b"\0\0\0\0", b"\0\1\0\0", 1) + f"{topic}{k}".encode()
    log.add(STREAMS[topic], cdr, stamp_ns, received_ns=-1)


def announce(log: LockstepLog, k: int, with_camera: bool) -> None:
    topics = ["joint_states", "imu/tip"] + ["camera/pose"] * with_camera
    log.announce(k, k * PERIOD_NS, topics, [1] * len(topics))


def record(rng: np.random.Generator, ticks: int) -> Written:
    log, written = lockstep_log()
    for k in range(ticks):
        actions = [lambda k=k, t=t: send(log, t, k) for t in ("joint_states", "imu/tip")]
        actions += [lambda k=k: announce(log, k, k % 3 == 2), lambda k=k: send(log, "tick", k)]
        if k % 3 == 2:
            actions.append(lambda k=k: send(log, "camera/pose", k, delay=2))
        answers = [
            lambda k=k, t=t: send(log, t, k) for t in ("joint_commands", "modal_state", "end_effector")
        ]
        for action in [*rng.permutation(actions), *rng.permutation(answers)]:
            action()
    assert log.close() == 0
    return written


def test_any_order_of_arrival_gives_the_same_bag() -> None:
    expected = record(np.random.default_rng(0), 400)
    assert len(expected) == 400 * 6 + 400 // 3
    assert all(record(np.random.default_rng(seed), 400) == expected for seed in range(1, 5))


def test_log_times_are_those_of_the_ticks_and_never_fall() -> None:
    written = record(np.random.default_rng(1), 400)
    times = [log_time for _, log_time, _ in written]
    assert times == sorted(times)
    late = [(name, log_time, cdr) for name, log_time, cdr in written if "camera" in name][0]
    assert late[:2] == ("/flexarm/camera/pose", 2 * PERIOD_NS)
    assert late[2].endswith(b"camera/pose2")


def test_cause_comes_before_effect_within_a_tick() -> None:
    first = [
        name.removeprefix("/flexarm/")
        for name, log_time, _ in record(np.random.default_rng(2), 3)
        if log_time == 0
    ]
    assert first == ["joint_states", "imu/tip", "tick", "modal_state", "end_effector", "joint_commands"]


def test_messages_are_written_while_the_run_goes_on() -> None:
    log, written = lockstep_log()
    ticks = 3 * HORIZON_NS // PERIOD_NS
    for k in range(ticks):
        send(log, "joint_states", k)
        send(log, "imu/tip", k)
        announce(log, k, with_camera=False)
    assert len(written) >= ticks
    log.close()
    assert len(written) == 2 * ticks


def test_what_comes_from_outside_is_logged_at_the_newest_tick() -> None:
    log, written = lockstep_log()
    log.add(STREAMS["model"], b"model", 0, received_ns=-1)
    log.add(STREAMS["reference"], b"first", 0, received_ns=-1)
    for k in range(3):
        send(log, "joint_states", k)
        send(log, "imu/tip", k)
        announce(log, k, with_camera=False)
    log.add(STREAMS["reference"], b"second", 123, received_ns=-1)
    log.add(STREAMS["robot_description"], b"urdf", None, received_ns=-1)
    log.close()
    assert [name for name, time, _ in written[:2] if time == 0] == ["/flexarm/model", "/flexarm/reference"]
    times = {cdr: time for _, time, cdr in written}
    assert times[b"second"] == times[b"urdf"] == 2 * PERIOD_NS


def test_a_lost_message_is_counted() -> None:
    log, _ = lockstep_log()
    send(log, "joint_states", 0)
    announce(log, 0, with_camera=True)
    assert log.close() == 2  # imu and camera


def test_what_follows_the_last_tick_is_kept() -> None:
    log, written = lockstep_log()
    send(log, "joint_states", 0)
    log.announce(0, 0, ["joint_states"], [1])
    send(log, "guard_status", 1)
    assert log.close() == 0
    assert [(name, time) for name, time, _ in written] == [
        ("/flexarm/joint_states", 0),
        ("/flexarm/guard_status", PERIOD_NS),
    ]


def test_a_frame_whose_tick_was_not_sent_any_more_comes_after_the_newest_tick() -> None:
    log, written = lockstep_log()
    for k in range(3):
        send(log, "joint_states", k)
        send(log, "tick", k)
        log.announce(k, k * PERIOD_NS, ["joint_states"], [1])
    send(log, "camera/pose", 3, delay=2)  # exposed before tick 2, sent after it
    assert log.close() == 0
    assert [name for name, _, _ in written[-2:]] == ["/flexarm/tick", "/flexarm/camera/pose"]
    assert written[-1][1] > written[-2][1]


@pytest.mark.parametrize("topic", ["joint_states", "modal_state", "reference"])
def test_in_real_time_the_log_time_is_that_of_arrival(topic: str) -> None:
    written: Written = []
    log = ArrivalLog(list(STREAMS.values()), lambda *item: written.append(item))
    log.add(STREAMS[topic], b"x", 5, received_ns=7)
    log.announce(0, 5, [topic], [1])
    assert written == [(f"/flexarm/{topic}", 7, b"x")]
    assert log.close() == 0


def test_a_reference_from_outside_is_logged_when_it_comes_and_the_controller_s_own_at_its_stamp() -> None:
    log, written = lockstep_log()
    for k in range(3):
        announce(log, k, with_camera=False)
        for topic in ("joint_states", "imu/tip"):
            send(log, topic, k)
    for frame in ("", "controller"):
        text = frame.encode() + b"\0"
        cdr = struct.pack("<4siII", b"\0\1\0\0", 0, 7 * PERIOD_NS, len(text)) + text
        assert header_frame_id(cdr) == frame
        log.add(STREAMS["reference"], cdr, 7 * PERIOD_NS, received_ns=-1)
    log.close()
    assert [t // PERIOD_NS for name, t, _ in written if name.endswith("reference")] == [2, 7]


def test_a_rig_that_starts_again_does_not_turn_the_log_back() -> None:
    log, written = lockstep_log()
    for sequence, stamp_ns in enumerate((0, 5 * PERIOD_NS, 0)):
        send(log, "joint_states", sequence)
        log.announce(sequence, stamp_ns, ["joint_states"], [1])
    log.add(STREAMS["reference"], b"outside", 123, received_ns=-1)
    log.close()
    assert {cdr: time for _, time, cdr in written}[b"outside"] == 5 * PERIOD_NS


def test_what_is_stamped_before_time_began_is_logged_when_it_comes() -> None:
    """A bag has no time below zero: closing it failed, and nothing said where its messages are."""
    log, written = lockstep_log()
    send(log, "tick", 0)
    cdr = struct.pack("<4siI", b"\0\1\0\0", -5, 0) + struct.pack("<I", 11) + b"controller\0"
    assert header_frame_id(cdr) == "controller"
    log.add(STREAMS["reference"], cdr, -5_000_000_000, received_ns=-1)
    log.close()
    assert all(log_time >= 0 for _, log_time, _ in written)
