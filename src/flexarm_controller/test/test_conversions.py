"""Messages: round trips, and nothing malformed gets further than its conversion."""

from typing import get_args

import numpy as np
import pytest
from served_arms import limits_of_hub, single_link, state_of

pytest.importorskip("flexarm_interfaces.msg")

from flexarm_interfaces.msg import ControllerStatus, ModalState  # noqa: E402

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


def test_missing_velocities_and_accelerations_are_zero():
    msg = reference_to_msg(example_reference(), ("base.rz",), EPOCH)
    for point in msg.points:
        point.velocities, point.accelerations = [], []
    reference = reference_from_msg(msg, ("base.rz",), EPOCH)
    assert not reference.theta_dot.any() and not reference.theta_ddot.any()


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
    return msg


@pytest.mark.parametrize(
    ("how", "text"),
    [
        ("names", "elbow.rz"),
        ("empty", "positions"),
        ("length", "positions"),
        ("nan", "not finite"),
        ("order", "time does not increase"),
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
