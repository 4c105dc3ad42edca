"""What is cancelled on its way comes to rest sooner than it would have, and no farther; described arms.

The oracle of the torques is in `described_arm.py`.
"""

import numpy as np
import pytest
from described_arm import ALMOST, Arm, at_rest
from served_arms import limits_of_hub, single_link

from flexarm_controller.motion.axis_limits import AxisLimits
from flexarm_controller.motion.motion_server import MotionServer
from flexarm_controller.motion.planner import MotionPlanner
from flexarm_controller.motion.point_to_point import move, state_at
from flexarm_controller.motion.refusals import MotionError
from flexarm_controller.motion.settings import MotionConfig
from flexarm_controller.motion.tip_kinematics import TipKinematics
from flexarm_controller.reference import Reference
from flexarm_controller.state import ArmState

OTHERS = ("single_link", "planar_3rrr", "spatial_3tpt", "variable_stiffness")
SHARES = (0.05, 0.3, 0.5, 0.65, 0.8, 0.95)  # of a motion's time
PERIOD = 0.005
ROUNDING = 1e-9  # of a way
H = 1e-4  # s; between torques whose difference is a rate: far below any ramp of a torque


class Led:
    """Follows a reference without error."""

    def __init__(self, model, limits, reference):
        self.model, self.limits, self.reference, self.ended_by = model, limits, reference, ""

    def follow(self, reference):
        fault = reference.fault(self.limits, self.model.theta_names)
        self.reference = self.reference if fault else reference
        return fault

    def follows(self, reference):
        return self.reference is reference

    def state(self, t):
        begin, still = state_at(self.reference, t), np.zeros(self.model.n - self.model.n_theta)
        parts = begin.theta, still, begin.theta_dot, still, np.zeros(self.model.n_theta)
        return ArmState(t, self.model.model_id, *parts)


@pytest.fixture(
    scope="module", params=["serial_6r", *(pytest.param(name, marks=pytest.mark.slow) for name in OTHERS)]
)
def arm(request):
    arm = Arm(request.param)
    arm.server = MotionServer(TipKinematics(arm.tree), arm.limits, MotionConfig(), PERIOD)
    arm.home = np.array(arm.config.home)
    return arm


def cancelled(server, led, t):
    """Return the answer, and what leads the arm from ``t`` on."""
    server.end(t, "another try")
    answer = server.cancel(0, led, led.state(t - PERIOD))
    return answer, led.reference


def goals(arm, seed, count):
    """Return goals half-way to such all over the ranges: near their ends a 3RRR is singular."""
    return arm.home + 0.5 * (arm.goals(seed, count) - arm.home)


def hardest(arm, motion, count=3):
    """Return the largest share of a torque and of a torque rate, (2,)."""
    t = np.linspace(motion.t[0], motion.t[-1] - 2 * H, count)
    torques, later = (arm.torques(*motion.sample(at)) for at in (t, t + H))
    rates = abs(later - torques) / H
    return (abs(torques) / arm.limits.effort).max(), (rates / arm.limits.effort_rate).max()


def test_a_motion_that_is_cancelled_rests_sooner_than_it_would_and_does_not_pass_its_goal(arm):
    """A 6R that had 0.4 s to go went on for 2.1 s, and 1.9 rad past its goal."""
    config, shares = MotionConfig(), []
    for goal in goals(arm, 5, 2):
        motion = arm.planner().move(at_rest(arm.home), goal)
        for t in motion.t[-1] * np.array(SHARES):
            answer, halt = cancelled(arm.server, Led(arm.model, arm.limits, motion), t)
            assert answer.is_accepted and halt.t[0] == pytest.approx(t) and not halt.theta_dot[-1].any()
            assert answer.duration <= motion.t[-1] - t
            for before, after in zip(motion.sample(halt.t[:1]), halt.sample(halt.t[:1]), strict=True):
                np.testing.assert_allclose(after, before, atol=1e-9)
            past = (halt.sample(np.linspace(t, halt.t[-1], 50))[0] - goal) * np.sign(goal - arm.home)
            assert (past <= ROUNDING * abs(goal - arm.home)).all()
            torque, rate = hardest(arm, halt)
            assert torque < config.motion_effort + ALMOST and rate < 1.0
            shares.append(answer.duration / (motion.t[-1] - t))
    assert np.median(shares) < 0.9


def test_a_motion_that_turned_on_its_way_can_be_cancelled_and_rests_no_later(arm):
    planner = arm.planner()
    for first, second in zip(*np.split(goals(arm, 6, 2), 2), strict=True):
        begun = planner.move(at_rest(arm.home), first)
        t = 0.4 * begun.t[-1]
        turned = planner.move(state_at(begun, t), second, t)
        for now in t + (turned.t[-1] - t) * np.array(SHARES):
            answer, halt = cancelled(arm.server, Led(arm.model, arm.limits, turned), now)
            assert answer.is_accepted and answer.duration <= turned.t[-1] - now
            assert hardest(arm, halt)[0] < MotionConfig().motion_effort + ALMOST


class OneArm:
    """Plans for the single link, wherever its tip is."""

    def __init__(self, planner):
        self.planner = planner

    def of(self, model):
        return self.planner


def test_what_could_only_be_stopped_beyond_a_range_goes_on_to_its_own_end():
    """Such a request was refused, and the motion went on as if nothing had been said."""
    model, limits = single_link(), limits_of_hub()
    most = limits.effort / 0.3648  # kg m^2, of hub and link: all of the torque, of which a stop has no more
    box = AxisLimits(limits.velocity, most, np.full(1, np.inf))
    motion = move(at_rest([0.0]), np.array([limits.position_high[0] - 1e-5]), box)
    t = motion.t[-1] - 0.03  # it brakes since 0.05 s
    planner = MotionPlanner(model, limits, MotionConfig(), ())
    with pytest.raises(MotionError, match="leaves the joint limits"):
        planner.stop(state_at(motion, t), t)
    server = MotionServer.__new__(MotionServer)
    server.planner = OneArm(planner)
    halt = server._halt(model, motion, t)
    at = np.linspace(t, motion.t[-1], 50)
    np.testing.assert_allclose(halt.sample(at)[0], motion.sample(at)[0], atol=1e-9)
    assert halt.t[-1] == motion.t[-1]


def test_one_that_ends_moving_and_cannot_be_stopped_goes_its_way_to_the_last_sample():
    """It was bent to come to rest there all along its last cubic."""
    model, limits = single_link(), limits_of_hub()
    end, t = limits.position_high - 1e-5, 0.97
    motion = Reference.through(np.array([0.0, 1.0]), np.array([end - 3.0, end]), np.array([[0.0], [5.0]]))
    server = MotionServer.__new__(MotionServer)
    server.planner = OneArm(MotionPlanner(model, limits, MotionConfig(), ()))
    with pytest.raises(MotionError, match="leaves the joint limits"):
        server.planner.of(model).stop(state_at(motion, t), t)
    at = np.linspace(t, 1.0 - 1e-6, 50)
    left = server._halt(model, motion, t).sample(at)
    for found, expected in zip(left, motion.sample(at), strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-9)
