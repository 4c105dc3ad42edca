"""What the drives obey: seal, attachment, watchdog."""

import math
import random
import struct
from dataclasses import replace

import pytest

from flexarm_controller.drives.attachment import Attachment, Sealed
from flexarm_controller.drives.seal import Mark, Seal
from flexarm_controller.drives.watchdog import BRIDGED, DriveLimits, DriveWatchdog

T = 0.005
LIMITS = DriveLimits((10.0, 4.0), (1000.0, 400.0), (2.0, 0.5), (5.0, 2.0), T, (0.1, 0.2))
STILL = (0.0, 0.0)
SECRET = "5e" * 16
TORQUES, MARK = [1.25, -0.5], Mark(True, 3)


def sealed(stamp_ns, effort=TORQUES, secret=SECRET, mark=MARK):
    return Sealed(stamp_ns, effort, Seal(secret).write(mark, stamp_ns, effort))


def attached():
    attachment = Attachment()
    attachment.attach(SECRET)
    return attachment


def test_a_seal_is_read_by_who_has_the_secret():
    for mark in (Mark(True, 0), Mark(False, 17)):
        assert attached().open(sealed(5, mark=mark)) == mark


def test_no_bit_of_a_sealed_message_can_be_changed():
    told = sealed(1_000_000)
    bits = struct.pack("<d", told.effort[0])
    for bit in range(64):
        changed = bytearray(bits)
        changed[bit // 8] ^= 1 << bit % 8
        effort = [*struct.unpack("<d", changed), told.effort[1]]
        assert attached().open(replace(told, effort=effort)) is None
    assert attached().open(replace(told, stamp_ns=told.stamp_ns + 1)) is None
    assert attached().open(replace(told, effort=[])) is None
    for place in range(len(told.mark)):
        text = told.mark[:place] + chr(ord(told.mark[place]) ^ 1) + told.mark[place + 1 :]
        assert attached().open(replace(told, mark=text)) is None


def test_none_of_a_thousand_forged_or_replayed_torques_is_obeyed():
    rng, attachment = random.Random(1), attached()
    authentic = [sealed(k) for k in range(1, 6)]
    assert all(attachment.open(told) for told in authentic)
    for _ in range(500):
        forged = sealed(rng.randrange(10, 10**9), secret=f"{rng.getrandbits(128):032x}")
        assert attachment.open(forged) is None
        assert attachment.open(rng.choice(authentic)) is None
    assert attachment.refused == 1000
    assert attachment.open(sealed(10))


@pytest.mark.parametrize("text", ["", "driving 1", "\N{SNOWMAN}", "driving 1 " + "0" * 24, " " * 50])
def test_what_is_no_seal_is_refused(text):
    assert attached().open(Sealed(1, TORQUES, text)) is None


def test_nothing_is_obeyed_without_a_guard_nor_after_its_release_nor_when_it_is_old():
    attachment = Attachment()
    assert attachment.open(sealed(1)) is None and attachment.fingerprint == ""
    attachment.attach(SECRET)
    assert attachment.fingerprint == Seal(SECRET).fingerprint
    assert attachment.open(sealed(99), oldest_ns=100) is None
    assert attachment.open(sealed(100), oldest_ns=100)
    attachment.release()
    assert attachment.open(sealed(101)) is None


def test_the_secret_of_the_guard_before_is_void():
    attachment = attached()
    attachment.attach("another")
    assert attachment.open(sealed(1)) is None
    assert attachment.open(sealed(1, secret="another"))


def obeying(effort=TORQUES):
    watchdog = DriveWatchdog(LIMITS)
    watchdog.attach()
    assert watchdog.step(effort, STILL) == effort
    return watchdog


def test_drives_that_nobody_guards_damp():
    assert DriveWatchdog(LIMITS).step(None, (-0.5, 0.5)) == [1.0, -0.25]
    assert DriveWatchdog(LIMITS).step([9.0, 9.0], (-0.5, 0.5)) == [1.0, -0.25]


def test_silence_is_bridged_then_fades_in_a_line_and_ends_in_damping_at_50_ms():
    watchdog = obeying()
    told = [watchdog.step(None, STILL) for _ in range(12)]
    periods = round(0.05 / T)
    line = [1.0] * BRIDGED + [(periods - k) / (periods - BRIDGED) for k in range(BRIDGED + 1, periods + 1)]
    for k, share in enumerate(line):
        assert told[k] == pytest.approx([share * value for value in TORQUES], abs=1e-12)
    assert watchdog.has_let_go and watchdog.missed == periods
    assert watchdog.step(TORQUES, (0.0, 0.8)) == [0.0, -0.4]


def test_a_torque_in_time_ends_the_silence():
    watchdog = obeying()
    for _ in range(9):
        watchdog.step(None, STILL)
    assert not watchdog.has_let_go
    assert watchdog.step([0.5, 0.0], STILL) == [0.5, 0.0] and watchdog.silent == 0


@pytest.mark.parametrize("effort", [[math.nan, 0.0], [math.inf, 0.0], [1.0], [1.0, 1.0, 1.0], []])
def test_torques_that_cannot_be_meant_count_as_silence(effort):
    watchdog = obeying()
    assert watchdog.step(effort, STILL) == TORQUES
    assert watchdog.silent == 1


def released():
    watchdog = obeying()
    watchdog.open_brakes()
    assert not watchdog.are_brakes_closed
    return watchdog


def periods_until_closed(watchdog, velocity):
    """Return after how many periods of silence the brakes are closed; None: not within a second."""
    for k in range(1, round(1.0 / T)):
        watchdog.step(None, velocity)
        if watchdog.are_brakes_closed:
            return k
    return None


def test_the_motors_bear_what_the_guard_sends_when_closed_brakes_open_and_no_more_than_they_can():
    steep, beyond = (1.0, -1.0), (100.0, -100.0)
    slow = replace(LIMITS, effort_rate=(1.0, 1.0))
    for asked, borne in ((steep, list(steep)), (beyond, [LIMITS.effort[0], -LIMITS.effort[1]])):
        watchdog = DriveWatchdog(slow)
        watchdog.attach()
        watchdog.open_brakes(asked)
        assert watchdog.step(borne, STILL) == borne
        watchdog.open_brakes([0.0, 0.0])  # they are open: the rate is limited
        assert watchdog.step([0.0, 0.0], STILL) == pytest.approx([borne[0] - T, borne[1] + T])
    for useless in ((math.nan, 0.0), (1.0,)):
        watchdog = DriveWatchdog(slow)
        watchdog.attach()
        watchdog.open_brakes(useless)
        assert watchdog.step([0.0, 0.0], STILL) == [0.0, 0.0]


def test_brakes_are_closed_until_the_attached_guard_drives():
    watchdog = DriveWatchdog(LIMITS)
    watchdog.open_brakes()  # nobody is attached who could
    assert watchdog.are_brakes_closed
    watchdog.attach()
    assert watchdog.are_brakes_closed
    watchdog.step(TORQUES, (9.0, 9.0))
    assert watchdog.are_brakes_closed
    watchdog.open_brakes()
    assert not watchdog.are_brakes_closed


@pytest.mark.parametrize(
    ("velocity", "closed"),
    [
        (STILL, 0.05),
        ((0.1, -0.2), 0.05),
        ((0.11, 0.0), 0.15),
        ((0.0, -0.21), 0.15),
        ((math.nan, 0.0), 0.15),
        ((math.inf, -9.0), 0.15),
    ],
)
def test_brakes_close_when_a_silent_guard_s_arm_is_slow_or_has_been_damped_for_a_tenth_of_a_second(
    velocity, closed
):
    assert periods_until_closed(released(), velocity) == pytest.approx(closed / T, abs=1.0)


def test_brakes_close_as_soon_as_damping_has_made_the_arm_slow():
    watchdog, count = released(), 0
    while not watchdog.are_brakes_closed:
        count += 1
        watchdog.step(None, (1.0 if count < 20 else 0.1, 0.0))
    assert count == 20


def test_brakes_stay_open_as_long_as_the_guard_speaks_and_closed_until_another_one_drives():
    watchdog = released()
    for _ in range(200):
        watchdog.step(TORQUES, STILL)
    assert not watchdog.are_brakes_closed
    assert periods_until_closed(watchdog, STILL) == round(0.05 / T)
    watchdog.open_brakes()
    watchdog.step(TORQUES, (9.0, 9.0))
    assert watchdog.are_brakes_closed  # once closed it does not matter what moves
    watchdog.attach()
    watchdog.step(TORQUES, STILL)
    assert watchdog.are_brakes_closed  # a new guard that stands
    watchdog.open_brakes()
    assert periods_until_closed(watchdog, (9.0, 0.0)) == pytest.approx(0.15 / T, abs=1.0)  # anew


def test_no_torque_leaves_its_limits_and_none_changes_faster_than_it_may():
    rng, watchdog = random.Random(2), DriveWatchdog(LIMITS)
    last = [0.0, 0.0]
    for k in range(3000):
        if k % 100 == 0:
            watchdog.attach()
        effort = [rng.uniform(-50.0, 50.0) for _ in range(2)] if rng.random() < 0.5 else None
        tau = watchdog.step(effort, (rng.gauss(0.0, 10.0), rng.choice([math.nan, math.inf, 1.0])))
        for axis, value in enumerate(tau):
            assert abs(value) <= LIMITS.effort[axis]
            assert abs(value - last[axis]) <= LIMITS.effort_rate[axis] * T * (1 + 1e-12)
        last = tau


def watch(watchdog, velocities):
    for v in velocities:
        watchdog.step(None, (0.0, v))
    return watchdog


def test_a_guard_may_attach_where_the_arm_has_been_at_rest_for_a_quarter_of_a_second():
    watchdog = DriveWatchdog(LIMITS)
    unknown = "the arm has not been watched for long enough"
    assert watchdog.unready() == unknown and watchdog.unready(must_know=False) == ""
    assert watch(watchdog, [0.0] * 49).unready() == unknown
    assert watch(watchdog, [0.6]).unready() == "axis 2 moves at 0.012, at rest it does up to 0.01"
    assert watch(watchdog, [0.0] * 50).unready() == ""


def test_an_axis_that_swings_is_not_at_rest_where_it_turns_and_one_with_noise_is():
    """At 1 Hz one sample of the swing is as slow as rest; noise is thirty times as fast as rest."""
    swing = [0.5 * math.sin(2.0 * math.pi * T * (k + 0.5)) for k in range(101)]
    assert abs(swing[99]) < LIMITS.rest_velocity
    assert watch(DriveWatchdog(LIMITS), swing[:100]).unready().startswith("axis 2 moves at 0.3")
    rng = random.Random(3)
    told = [rng.gauss(0.0, 3e-4) for _ in range(201)]  # rad, of an encoder
    noise = [(b - a) / T for a, b in zip(told, told[1:], strict=False)]
    assert max(map(abs, noise[-50:])) > 0.1
    assert watch(DriveWatchdog(LIMITS), noise).unready() == ""


@pytest.mark.parametrize("v", [math.nan, math.inf])
def test_where_nobody_knows_how_the_arm_moves_no_guard_may_attach(v):
    watchdog = watch(DriveWatchdog(LIMITS), [0.0] * 60)
    assert watch(watchdog, [v]).unready() == "drives do not tell the velocity of every axis"
    assert watch(watchdog, [v]).unready(must_know=False) == "drives do not tell the velocity of every axis"
