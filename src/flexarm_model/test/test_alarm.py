"""The alarm in the loop of a node."""

import math

from flexarm_model.ros.alarm import Alarm


class Clock:
    """Shows what it is set to."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


def test_it_rings_once_when_its_time_has_come() -> None:
    clock, rung = Clock(), []
    alarm = Alarm(lambda: rung.append(clock.now), clock)
    alarm.due = 2.0
    for clock.now in (1.0, 1.999, 2.5, 3.0):
        alarm.look()
    assert rung == [2.5]


def test_it_may_be_set_anew_by_what_it_calls() -> None:
    clock, rung = Clock(), []

    def ring() -> None:
        rung.append(clock.now)
        alarm.due = clock.now + 1.0

    alarm = Alarm(ring, clock)
    alarm.due = 0.0
    for clock.now in (0.0, 0.5, 1.0, 1.5, 2.25):
        alarm.look()
    assert rung == [0.0, 1.0, 2.25]


def test_the_loop_waits_until_it_is_due_but_not_longer_than_it_may() -> None:
    clock = Clock()
    alarm = Alarm(lambda: None, clock)
    assert alarm.wait(0.1) == 0.1
    alarm.due = 5.0
    for clock.now, wait in ((4.0, 0.1), (4.95, 0.05), (5.0, 0.0), (6.0, 0.0)):
        assert math.isclose(alarm.wait(0.1), wait, abs_tol=1e-12)
    alarm.cancel()
    assert alarm.wait(0.1) == 0.1
