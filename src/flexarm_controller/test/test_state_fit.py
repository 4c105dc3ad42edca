"""A state of wrong length, or of no instant, is refused by name; the controller goes on without it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from served_arms import limits_of_hub, single_link, state_of

from flexarm_controller.controller import Controller
from flexarm_controller.reference import hold
from flexarm_controller.settings import ControllerConfig
from flexarm_controller.state_fit import fitted

DT = 0.005
MODEL = single_link()
MOVING = np.array([0.1, 1e-4, 0, 0, 1.0, 0, 0, 0])
MISFITS = [
    ("theta", (2,), "state has 2 theta, the model 1"),
    ("theta", (0,), "state has 0 theta, the model 1"),
    ("theta", (1, 1), "state has an array of shape (1, 1) as theta, the model 1"),
    ("theta", (), "state has an array of shape () as theta, the model 1"),
    ("theta_dot", (2,), "state has 2 theta_dot, the model 1"),
    ("theta_dot", (0,), "state has 0 theta_dot, the model 1"),
    ("eta", (2,), "state has 2 eta, the model 3"),
    ("eta", (4,), "state has 4 eta, the model 3"),
    ("eta_dot", (2,), "state has 2 eta_dot, the model 3"),
    ("eta_dot", (6,), "state has 6 eta_dot, the model 3"),
    ("d", (2,), "state has 2 d, the model 1"),
    ("d", (0,), "state has 0 d, the model 1"),
    ("sigma", (3,), "state has 3 sigma, the model 8"),
    ("sigma", (9,), "state has 9 sigma, the model 8"),
    ("sag", (4,), "state has 4 sag, the model at most 3"),
    ("sag", (3, 1), "state has an array of shape (3, 1) as sag, the model at most 3"),
    ("stiffness", (4,), "state has 4 stiffness, the model at most 3"),
]


@pytest.fixture(scope="module", params=["mpc", "lqr", "pd"])
def law(request):
    return request.param


@pytest.fixture(scope="module")
def controller(law):
    return Controller(MODEL, limits_of_hub(), ControllerConfig(law=law))


@pytest.mark.parametrize(("name", "shape", "reason"), MISFITS)
def test_a_state_of_wrong_length_brakes_with_the_reason(controller, name, shape, reason):
    """One too long was driven on with another torque and no reason; one too short ended the loop."""
    controller.reset()
    command = controller.step(replace(state_of(MOVING, MODEL), **{name: np.zeros(shape)}))
    assert command.reason == f"estimator: {reason}"
    assert command.mode == ("hold" if name == "theta_dot" else "damping")  # a velocity that fits is used
    assert command.tau.shape == (1,) and command.tracking_error.shape == (1,)
    assert abs(command.tau[0]) <= limits_of_hub().effort[0]


@pytest.mark.parametrize("t", [math.nan, math.inf, -math.inf])
def test_a_state_of_no_instant_brakes_and_the_next_one_goes_on(controller, law, t):
    controller.reset()
    for nowhere in (t, 0.0, t, 2 * DT):
        command = controller.step(state_of(MOVING, MODEL, nowhere))
        assert command.mode == (law if math.isfinite(nowhere) else "damping")
        assert command.reason == ("" if command.mode == law else f"estimator: state is of the instant {t}")
        assert np.isfinite(command.tau).all()


def test_a_reference_can_be_taken_after_a_state_of_no_instant(controller, law):
    controller.reset()
    controller.step(state_of(MOVING, MODEL, 0.0))
    controller.step(state_of(MOVING, MODEL, math.nan))
    assert controller.follow(hold([0.1], 0.0)) == ""
    command = controller.step(state_of(MOVING, MODEL, 2 * DT))
    assert command.mode == law and command.reference is not None
    assert all(np.isfinite(part).all() for part in (command.reference.t, command.reference.theta))


def test_a_state_of_another_model_with_more_modes_still_says_which_side_is_behind(controller):
    controller.reset()
    state = replace(state_of(MOVING, MODEL), model_id="other", eta=np.zeros(5), eta_dot=np.zeros(5))
    command = controller.step(state)
    assert command.mode == "damping" and command.reason.endswith("the controller lacks it")


def test_a_state_that_fits_is_handed_on_as_it_is():
    state = replace(state_of(MOVING, MODEL), sigma=np.ones(8), sag=np.zeros(2), stiffness=np.zeros(3))
    assert fitted(state, MODEL) is state
