"""Messages: round trips, and nothing malformed gets further than its conversion."""

from itertools import pairwise
from typing import get_args

import numpy as np
import pytest
from served_arms import limits_of_hub, single_link, state_of

pytest.importorskip("flexarm_interfaces.msg")

from builtin_interfaces.msg import Duration  # noqa: E402
from flexarm_interfaces.msg import ControllerStatus, ModalState  # noqa: E402
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint  # noqa: E402

from flexarm_controller.command import Mode  # noqa: E402
from flexarm_controller.controller import Controller  # noqa: E402
from flexarm_controller.conversions import (  # noqa: E402
    ReferenceMessageError,
    command_to_msg,
    notice_msg,
    reference_from_msg,
    reference_to_msg,
    state_from_msg,
    status_to_msg,
)
from flexarm_controller.reference import Reference  # noqa: E402
from flexarm_controller.time_budget import Clocks  # noqa: E402
from flexarm_model.conversions import ns_to_stamp, stamp_to_ns  # noqa: E402

MODEL = single_link()
EPOCH = 1_700_000_000_000_000_123


def modal_state(**changes):
    msg = ModalState(model_id=MODEL.model_id, status=ModalState.OK)
    msg.header.stamp = ns_to_stamp(EPOCH + 1_250_000_000)
    fields = {
        "theta": [0.1],
        "theta_dot": [0.2],
        "disturbance": [0.3],
        "eta": [1.0, 2.0, 3.0],
        "eta_dot": [4.0, 5.0, 6.0],
    }
    for name, value in (fields | changes).items():
        setattr(msg, name, value)
    return msg


def test_a_state_arrives_with_its_numbers_and_its_time():
    state = state_from_msg(modal_state(), MODEL, EPOCH)
    assert state.t == pytest.approx(1.25, abs=1e-12) and state.usable and state.model_id == MODEL.model_id
    np.testing.assert_array_equal(state.x, [0.1, 1, 2, 3, 0.2, 4, 5, 6])
    np.testing.assert_array_equal(state.d, [0.3])
    assert state.vibration is state.x  # nobody told where the modes rest


def test_vibration_is_counted_from_where_the_modes_are_told_to_rest():
    state = state_from_msg(modal_state(sag=[0.25, -0.5]), MODEL, EPOCH)
    np.testing.assert_array_equal(state.sag, [0.25, -0.5])
    np.testing.assert_array_equal(state.vibration, [0.1, 0.75, 2.5, 3, 0.2, 4, 5, 6])
    np.testing.assert_array_equal(state.x, [0.1, 1, 2, 3, 0.2, 4, 5, 6])
    assert not state_from_msg(modal_state(sag=[np.nan]), MODEL, EPOCH).is_finite
    assert not state_from_msg(modal_state(sag=[0.0] * 4), MODEL, EPOCH).usable  # more than there are modes


def test_what_was_learned_of_the_stiffness_comes_with_the_state():
    state = state_from_msg(modal_state(stiffness=[-0.3, -0.3]), MODEL, EPOCH)
    np.testing.assert_array_equal(state.stiffness, [-0.3, -0.3])
    assert not state_from_msg(modal_state(), MODEL, EPOCH).stiffness.size
    assert not state_from_msg(modal_state(stiffness=[0.0] * 4), MODEL, EPOCH).usable


@pytest.mark.parametrize(
    ("status", "usable"),
    [
        (ModalState.OK, True),
        (ModalState.DEGRADED, True),
        (ModalState.LOST, False),
        (ModalState.STARTING, False),
        (77, False),
    ],
)
def test_only_ok_and_degraded_states_are_usable(status, usable):
    assert state_from_msg(modal_state(status=status, reason="why"), MODEL, EPOCH).usable == usable


@pytest.mark.parametrize("name", ["theta", "theta_dot", "disturbance", "eta", "eta_dot"])
@pytest.mark.parametrize("wrong", [[], [0.0] * 7])
def test_a_state_of_the_wrong_length_is_not_usable_and_says_its_sizes(name, wrong):
    state = state_from_msg(modal_state(**{name: wrong}), MODEL, EPOCH)
    assert not state.usable and "sizes" in state.reason and state.is_finite


@pytest.mark.parametrize("names", [["elbow.rz"], ["base.rz", "elbow.rz"]])
def test_a_state_of_other_axes_is_not_usable_and_says_of_which(names):
    """Axes in another order were taken to be in the model's."""
    assert MODEL.theta_names == ("base.rz",)
    state = state_from_msg(modal_state(joint_names=names), MODEL, EPOCH)
    assert not state.usable and state.reason == f"state is of {', '.join(names)}, not of base.rz"
    assert state_from_msg(modal_state(joint_names=["base.rz"]), MODEL, EPOCH).usable


def example_reference():
    t = np.array([2.0, 2.005, 3.0])
    rng = np.random.default_rng(1)
    return Reference(t, *(rng.standard_normal((3, 1)) for _ in range(3)))


def test_a_reference_survives_the_round_trip():
    reference = example_reference()
    back = reference_from_msg(reference_to_msg(reference, ("base.rz",), EPOCH), ("base.rz",), EPOCH)
    np.testing.assert_allclose(back.t, reference.t, atol=1e-9)  # stamps are whole nanoseconds
    for name in ("theta", "theta_dot", "theta_ddot"):
        np.testing.assert_array_equal(getattr(back, name), getattr(reference, name))


def of_points(t, *columns):
    """Return the message of positions, and velocities if there are any, of one axis."""
    points = [JointTrajectoryPoint(time_from_start=Duration(nanosec=round(1e9 * at))) for at in t]
    for name, values in zip(("positions", "velocities"), columns, strict=False):
        for point, value in zip(points, values, strict=True):
            setattr(point, name, [float(value)])
    return JointTrajectory(joint_names=["base.rz"], points=points)


def followed(t, *columns):
    return reference_from_msg(of_points(t, *columns), ("base.rz",), 0)


def assert_accelerations_are_those_of_the_motion(reference):
    """Within every interval, by central differences of the velocity, up to either end."""
    for begin, end in pairwise(reference.t):
        times, dt = np.linspace(begin, end, 9)[1:-1], 1e-5
        sides = [reference.sample(times + side)[1] for side in (dt, -dt)]
        np.testing.assert_allclose(reference.sample(times)[2], (sides[0] - sides[1]) / (2 * dt), atol=1e-6)


def test_missing_accelerations_are_those_of_the_cubics_on_either_side_of_a_point():
    """By hand: 0 -> 0.16 in 0.4 s between rests takes 6 ... -6 rad/s^2, and staying there none."""
    reference = followed([0.0, 0.5, 0.9], [0.0, 0.3, -0.2], [0.1, -0.4, 0.7])
    assert_accelerations_are_those_of_the_motion(reference)
    rests = followed([0.0, 0.4, 0.8], [0.0, 0.16, 0.16], [0.0, 0.0, 0.0])
    np.testing.assert_allclose(rests.theta_ddot[:, 0], [6.0, 0.0, 0.0], atol=1e-12)
    np.testing.assert_allclose(rests.theta_ddot_before[:, 0], [0.0, -6.0, 0.0], atol=1e-12)


def test_a_motion_of_positions_alone_does_not_stop_at_every_point():
    t = np.linspace(0.0, 0.9, 31)
    s = t / 0.9
    reference = followed(t, 10 * s**3 - 15 * s**4 + 6 * s**5)
    times = np.linspace(0.0, 0.9, 500)
    s = times / 0.9
    asked = (30 * s**2 - 60 * s**3 + 30 * s**4) / 0.9, (60 * s - 180 * s**2 + 120 * s**3) / 0.81
    _, theta_dot, theta_ddot = reference.sample(times[:-1])
    assert abs(theta_dot[:, 0] - asked[0][:-1]).max() < 1e-3 * asked[0].max()
    assert abs(theta_ddot[:, 0] - asked[1][:-1]).max() < 0.04 * asked[1].max()  # its jerk begins at once
    assert_accelerations_are_those_of_the_motion(reference)
    np.testing.assert_allclose(  # and nothing jumps between its ends
        reference.theta_ddot[1:-1], reference.theta_ddot_before[1:-1], atol=1e-9
    )


def test_one_or_two_positions_are_a_rest_or_a_cubic_from_rest_to_rest():
    reference = followed([0.0, 0.5], [0.0, 0.25])
    assert not reference.theta_dot.any()
    assert reference.sample([0.0])[2][0, 0] == pytest.approx(6.0)
    assert not followed([0.0], [0.3]).sample([-1.0, 0.0, 1.0])[1].any()


def test_accelerations_that_are_told_are_taken_as_they_are():
    msg = of_points([0.0, 0.5, 0.9], [0.0, 0.3, -0.2], [0.1, -0.4, 0.7])
    for point, value in zip(msg.points, (1.0, 2.0, 3.0), strict=True):
        point.accelerations = [value]
    reference = reference_from_msg(msg, ("base.rz",), 0)
    assert reference.theta_ddot[:, 0].tolist() == [1.0, 2.0, 3.0] and reference.theta_ddot_before is None


def test_the_axes_of_a_trajectory_may_be_named_in_any_order():
    """Of joint_states and drive_states they may be; a reference of such names was refused."""
    names, told = ("motor_1.rz", "motor_2.rz", "motor_3.rz"), ("motor_3.rz", "motor_1.rz", "motor_2.rz")
    columns = np.random.default_rng(3).normal(size=(3, 2, 3))  # of two points
    t = np.array([0.0, 0.5])
    straight, turned = Reference(t, *columns), Reference(t, *columns[..., [2, 0, 1]])
    expected = reference_from_msg(reference_to_msg(straight, names, EPOCH), names, EPOCH)
    back = reference_from_msg(reference_to_msg(turned, told, EPOCH), names, EPOCH)
    for name in ("t", "theta", "theta_dot", "theta_ddot"):
        np.testing.assert_array_equal(getattr(back, name), getattr(expected, name))


@pytest.mark.parametrize(
    "told", [("a.rz", "b.rz"), ("a.rz", "b.rz", "b.rz"), ("a.rz", "b.rz", "d.rz"), ("a.rz",) * 9]
)
def test_axes_that_are_missing_strange_or_told_twice_are_refused(told):
    msg = JointTrajectory(joint_names=told, points=[JointTrajectoryPoint(positions=[0.0] * len(told))])
    with pytest.raises(ReferenceMessageError, match=r"joint_names are .*; expected .*, in any order"):
        reference_from_msg(msg, ("a.rz", "b.rz", "c.rz"), EPOCH)


def spoil(msg, how):
    if how == "names":
        msg.joint_names = ["elbow.rz"]
    elif how == "empty":
        msg.points = []
    elif how == "length":
        msg.points[1].positions = [0.0, 0.0]
    elif how == "nan":
        msg.points[1].velocities = [float("nan")]
    elif how == "order":
        msg.points = msg.points[::-1]
    elif how == "some velocities":
        msg.points[1].velocities = []
    elif how == "some accelerations":
        msg.points[1].accelerations = []
    return msg


@pytest.mark.parametrize(
    ("how", "text"),
    [
        ("names", "elbow.rz"),
        ("empty", "positions"),
        ("length", "positions"),
        ("nan", "not finite"),
        ("order", "time does not increase"),
        ("some velocities", "velocities: every point needs 1 numbers, or none has any"),
        ("some accelerations", "accelerations: every point needs 1 numbers, or none has any"),
    ],
)
def test_a_malformed_trajectory_is_refused_with_the_reason(how, text):
    msg = spoil(reference_to_msg(example_reference(), ("base.rz",), EPOCH), how)
    with pytest.raises(ReferenceMessageError, match=text):
        reference_from_msg(msg, ("base.rz",), EPOCH)


def test_command_and_status_carry_what_the_controller_did():
    controller = Controller(MODEL, limits_of_hub(), clocks=Clocks(cpu=lambda: 0.0))
    state = state_of([0.1, 0, 0, 0, 0.5, 0, 0, 0], MODEL, 1.25)
    command = controller.step(state)
    msg = command_to_msg(command, MODEL.theta_names, 7, 2**63 + 1, EPOCH + 1_250_000_000)
    assert (msg.sequence, msg.session_token, msg.model_id) == (7, 2**63 + 1, MODEL.model_id)
    assert list(msg.effort) == list(command.tau) and list(msg.names) == ["base.rz"]
    assert stamp_to_ns(msg.header.stamp) == EPOCH + 1_250_000_000
    status = status_to_msg(command, 3, 2, EPOCH)
    assert (status.mode, status.reason) == (ControllerStatus.MPC, "")
    assert (status.missed_cycles, status.overruns) == (3, 2)
    assert list(status.tracking_error) == list(command.tracking_error)
    assert status.iterations == command.iterations and status.solver_status == command.solver_status


def test_every_mode_of_the_ladder_has_its_constant():
    controller = Controller(MODEL, limits_of_hub())
    lost = state_of(np.zeros(8), single_link("light_hub"))
    assert status_to_msg(controller.step(lost), 0, 0, 0).mode == ControllerStatus.HOLD
    held = controller.step(lost)
    told = [status_to_msg(held._replace(mode=mode), 0, 0, 0).mode for mode in get_args(Mode)]
    assert sorted(told) == list(range(len(told)))


def test_a_notice_says_only_its_reason():
    msg = notice_msg("reference refused: x", EPOCH)
    assert (msg.mode, msg.reason) == (ControllerStatus.INACTIVE, "reference refused: x")
    assert stamp_to_ns(msg.header.stamp) == EPOCH
