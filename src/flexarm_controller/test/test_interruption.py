"""A motion whose state was lost is over: the arm stays where it is, and nothing is run after."""

from dataclasses import replace

import numpy as np
import pytest
from served_arms import limits_of_hub, single_link, state_of

from flexarm_controller.controller import Controller
from flexarm_controller.interruption import Interruption
from flexarm_controller.reference import Reference, hold
from flexarm_controller.settings import ControllerConfig

DT = 0.005
MODEL = single_link()


def ramp(start=0.0, end=1.0, to=0.5):
    t = np.linspace(start, end, 50)
    velocity = np.full((50, 1), to / (end - start))
    return Reference(t, velocity * (t - start)[:, None], velocity, np.zeros((50, 1)))


def states(theta, first, count, *, usable=True):
    x = np.array([theta, 0, 0, 0, 0.0, 0, 0, 0])
    return [
        replace(state_of(x, MODEL, (first + k) * DT), usable=usable, reason="" if usable else "lost")
        for k in range(count)
    ]


def run(controller, some):
    return [controller.step(state) for state in some]


def moving(**settings):
    controller = Controller(MODEL, limits_of_hub(), ControllerConfig(**settings))
    run(controller, states(0.0, 0, 2))
    assert controller.follow(ramp(2 * DT, 1.0)) == ""
    assert run(controller, states(0.0, 2, 10))[-1].mode == "mpc"
    return controller


def test_a_short_gap_changes_nothing_and_a_long_one_ends_the_motion():
    controller = moving()
    reference = controller.reference
    run(controller, states(0.02, 12, 15, usable=False))  # 70 ms from the first to the last
    assert controller.reference is reference
    assert run(controller, states(0.02, 27, 1))[-1].mode == "mpc"
    told = run(controller, states(0.03, 28, 30, usable=False))
    assert controller.reference is None
    assert "the motion is given up" in told[-1].reason and "given up" not in told[0].reason
    back = run(controller, states(0.03, 58, 100))
    assert back[-1].mode == "mpc" and back[-1].reason == ""
    assert controller.reference.position(2.0) == pytest.approx([0.03])


def test_what_was_sent_meanwhile_and_has_begun_is_not_run_after_but_what_is_to_come_is_followed():
    for start, is_followed in ((0.2, False), (0.6, True)):
        controller = moving()
        run(controller, states(0.03, 12, 60, usable=False))
        assert controller.follow(ramp(start, 1.5)) == ""
        run(controller, states(0.03, 72, 40, usable=False))
        run(controller, states(0.03, 112, 10))
        wanted = 0.5 if is_followed else 0.03
        assert controller.reference.position(2.0) == pytest.approx([wanted])
        assert controller.follow(ramp(0.7, 1.5)) == ""  # a new one is as welcome as ever
        run(controller, states(0.03, 122, 10))
        assert controller.reference.position(2.0) == pytest.approx([0.5])


def test_before_the_first_usable_state_nothing_is_given_up():
    controller = Controller(MODEL, limits_of_hub(), ControllerConfig())
    assert controller.follow(ramp()) == ""
    told = run(controller, states(0.0, 0, 60, usable=False))
    assert "given up" not in told[-1].reason
    run(controller, states(0.0, 60, 3))
    assert controller.reference.position(2.0) == pytest.approx([0.5])


def test_it_is_never_given_up_before_the_earlier_plan_has_ended():
    controller = moving(lost_after=0.0, shifted_periods=5)
    run(controller, states(0.02, 12, 6, usable=False))
    assert controller.reference is not None
    run(controller, states(0.02, 18, 2, usable=False))
    assert controller.reference is None


def test_times_that_are_no_times_and_jumps_back_end_nothing_by_themselves():
    some = Interruption(0.1)
    told = [(5.0, "lost"), (float("nan"), "lost"), (1.0, "lost"), (1.05, "lost"), (1.1, "lost"), (1.2, ""),
            (1.25, "lost")]  # fmt: skip
    lasts = []
    for t, fault in told:
        some.note(t, fault)
        lasts.append(some.lasts)
    assert lasts == [False, False, False, False, True, False, False]


def test_a_hold_is_held_where_the_arm_was_found_again():
    controller = Controller(MODEL, limits_of_hub(), ControllerConfig())
    run(controller, states(0.1, 0, 5))
    controller.follow(hold(np.array([0.1])))
    run(controller, states(0.1, 5, 5))
    run(controller, states(0.1, 10, 30, usable=False))
    run(controller, states(0.3, 40, 5))
    assert controller.reference.position(1.0) == pytest.approx([0.3])
