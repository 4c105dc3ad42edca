"""Goals of the tip between messages, and references from outside: taken, told, stretched, refused."""

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("flexarm_interfaces.msg")

from flexarm_interfaces.msg import GuardStatus, ModalState, MotionStatus  # noqa: E402
from flexarm_interfaces.srv import CancelMotion, MoveTip  # noqa: E402

from flexarm_controller.conversions import reference_from_msg, reference_to_msg  # noqa: E402
from flexarm_controller.exchange import ControllerExchange  # noqa: E402
from flexarm_controller.motion.conversions import OWN_FRAME, pose_from_msg, pose_to_msg  # noqa: E402
from flexarm_controller.motion.motion_exchange import MotionExchange  # noqa: E402
from flexarm_controller.motion.settings import MotionConfig  # noqa: E402
from flexarm_controller.motion.tip_kinematics import TipKinematics  # noqa: E402
from flexarm_controller.reference import Reference  # noqa: E402
from flexarm_controller.settings import ControllerConfig, MpcConfig  # noqa: E402
from flexarm_model.conversions import model_to_msg, ns_to_stamp  # noqa: E402
from flexarm_model.reading.config import load_config  # noqa: E402
from flexarm_model.reading.manipulator_file import find_manipulator  # noqa: E402
from flexarm_model.served.linearize import linearize  # noqa: E402
from flexarm_model.tree.reduced_tree import ReducedTree  # noqa: E402

EPOCH, PERIOD_NS = 1_000_000_000, 5_000_000
PERIOD = 0.005  # s
REACH = 0.64  # m


@pytest.fixture(scope="module")
def config():
    return load_config(find_manipulator("single_link"), "light_hub")


@pytest.fixture(scope="module")
def model(config):
    return linearize(ReducedTree(config))


def tip_of(config):
    return TipKinematics(ReducedTree(config))


def arm_of(config, model, **settings):
    """Return exchange and goals of an armed controller that has seen its first state."""
    motion = MotionConfig(**settings)
    exchange = ControllerExchange(config, ControllerConfig(), MpcConfig(time_limit=0.0), None, motion=motion)
    goals = MotionExchange(config, tip_of(config), motion, PERIOD, exchange)
    exchange.on_model(model_to_msg(model))
    exchange.on_guard_status(GuardStatus(session_token=5))
    exchange.on_modal_state(state(model, 0))
    return exchange, goals


def state(model, k):
    msg = ModalState(model_id=model.model_id, status=ModalState.OK)
    msg.header.stamp = ns_to_stamp(EPOCH + k * PERIOD_NS)
    msg.theta = msg.theta_dot = msg.disturbance = [0.0]
    msg.eta = msg.eta_dot = [0.0] * 3
    return msg


def request_to(angle, **fields):
    request = MoveTip.Request(**fields)
    request.target.position.x, request.target.position.y = REACH * np.cos(angle), REACH * np.sin(angle)
    return request


def told(outgoing, topic):
    return [out.msg for out in outgoing if out.topic == topic]


def swing(angle, duration):
    """Bang-bang: constant acceleration, then deceleration."""
    t = np.array([0.0, duration / 2, duration])
    a = 4 * angle / duration**2
    theta, rate = np.array([0.0, angle / 2, angle]), np.array([0.0, a * duration / 2, 0.0])
    return Reference(t, theta[:, None], rate[:, None], np.array([a, -a, -a])[:, None])


def answer(exchange, reference):
    msg = reference_to_msg(reference, ("base.rz",), EPOCH + PERIOD_NS)
    return exchange.on_reference(msg)[0].msg.reason


def test_a_goal_is_answered_sent_as_a_reference_and_told(config, model):
    exchange, goals = arm_of(config, model)
    response, outgoing = goals.on_move_tip(request_to(0.3))
    assert (response.accepted, response.reason, response.goal_id) == (True, "", 1)
    (sent,) = told(outgoing, "reference")
    assert sent.header.frame_id == OWN_FRAME and sent.header.stamp == ns_to_stamp(EPOCH + PERIOD_NS)
    assert sent.points[-1].positions[0] == pytest.approx(0.3, abs=1e-6)
    assert told(outgoing, "motion_status")[0].state == MotionStatus.ACCEPTED
    again = reference_from_msg(sent, ("base.rz",), EPOCH)  # what a replay reads is what is followed
    for name in ("t", "theta", "theta_dot", "theta_ddot"):
        np.testing.assert_array_equal(getattr(again, name), getattr(exchange.controller.reference, name))
    exchange.on_modal_state(state(model, 30))
    (status,) = told(goals.update(), "motion_status")
    assert status.state == MotionStatus.EXECUTING and 0.0 < status.progress < 1.0
    assert status.distance == pytest.approx(2 * REACH * np.sin(0.15), rel=1e-4)
    assert status.header.stamp == state(model, 30).header.stamp


def planned_beside(exchange, goals, model, k, periods, meanwhile=lambda: None):
    """Ask for a goal whose every plan takes some periods; returns the period of the answer, and that."""
    thoughts = goals.moving_tip(request_to(0.3))
    try:
        draft = next(thoughts)
        while True:
            plan = goals._server.planner.plan(draft)
            meanwhile()
            for _ in range(periods):
                k += 1
                exchange.on_modal_state(state(model, k))
            draft = thoughts.send(plan)
    except StopIteration as end:
        return k, end.value


def begin_of(outgoing):
    """Return when the motion of a sent reference leaves where the arm is, in periods [1]."""
    (sent,) = told(outgoing, "reference")
    reference = reference_from_msg(sent, ("base.rz",), EPOCH)
    return reference.t[np.flatnonzero(reference.theta_ddot.any(axis=1))[0]] / PERIOD


def test_a_plan_that_took_longer_than_thought_is_made_again_with_more_time(config, model):
    """A motion begins at least the lead after it is taken; the next plan is given what this one took."""
    exchange, goals = arm_of(config, model)
    goals.ahead = 10 * PERIOD
    k, (response, outgoing) = planned_beside(exchange, goals, model, 0, 12)
    assert response.accepted and k == 24  # twice
    assert begin_of(outgoing) - k >= 1 + 0.05 / PERIOD
    assert goals.ahead == pytest.approx(1.5 * 12 * PERIOD)
    k, (response, outgoing) = planned_beside(exchange, goals, model, k, 12)
    assert response.accepted and k == 36  # once


def test_a_goal_waits_for_another_reference_that_came_while_it_was_planned(config, model):
    exchange, goals = arm_of(config, model)
    goals.ahead = 1.0
    others = iter([waiting(40)])

    def meanwhile():
        for msg in others:
            goals.on_reference(msg)

    k, (response, outgoing) = planned_beside(exchange, goals, model, 0, 2, meanwhile)
    assert response.accepted and k == 4
    assert exchange.controller.reference.theta[-1, 0] == pytest.approx(0.3, abs=1e-6)


def test_a_goal_is_refused_where_no_plan_is_ever_in_time(config, model):
    exchange, goals = arm_of(config, model)
    others = iter(range(41, 50))
    k, (response, _) = planned_beside(
        exchange, goals, model, 0, 2, lambda: goals.on_reference(waiting(next(others)))
    )
    assert not response.accepted and response.reason.startswith("planned 4 times")
    assert exchange.controller.reference.theta[-1, 0] != pytest.approx(0.3, abs=1e-6)


def test_a_goal_is_refused_when_the_guard_stops_the_arm_while_it_is_planned(config, model):
    exchange, goals = arm_of(config, model)
    goals.ahead = 1.0
    stop = GuardStatus(mode=GuardStatus.STOPPED, reason="a gauge")
    _, (response, outgoing) = planned_beside(
        exchange, goals, model, 0, 2, lambda: exchange.on_guard_status(stop)
    )
    assert not response.accepted and response.reason
    assert not told(outgoing, "reference")


def test_a_cancelled_goal_sends_the_way_to_rest(config, model):
    exchange, goals = arm_of(config, model)
    goals.on_move_tip(request_to(1.0))
    exchange.on_modal_state(state(model, 30))
    response, outgoing = goals.on_cancel(CancelMotion.Request(goal_id=1))
    (sent,) = told(outgoing, "reference")
    assert response.accepted and sent.points[-1].velocities[0] == 0.0
    assert sent.points[-1].positions[0] < 0.9
    last = sent.points[-1].time_from_start
    assert 0.0 < response.duration < last.sec + 1e-9 * last.nanosec


def test_a_malformed_goal_is_refused_with_the_field(config, model):
    exchange, goals = arm_of(config, model)
    before = exchange.controller.reference
    for spoil, reason in SPOILT:
        request = request_to(0.3, with_orientation=True)
        spoil(request)
        response, outgoing = goals.on_move_tip(request)
        assert not response.accepted and reason in response.reason
        assert [out.topic for out in outgoing] == ["motion_status"]  # and no reference
    assert exchange.controller.reference is before


SPOILT = (
    (lambda r: setattr(r, "duration", -1.0), "duration: -1.0 must be"),
    (lambda r: setattr(r, "duration", 8000.0), "duration: 8000 s, at most 3600 s are allowed"),
    (lambda r: setattr(r, "tolerance", float("nan")), "tolerance: nan must be"),
    (lambda r: setattr(r.target.position, "x", float("inf")), "is not finite"),
    (lambda r: setattr(r.target.orientation, "w", 0.5), "has not length 1"),
)


def test_without_model_state_or_guard_goals_are_refused(config, model):
    exchange = ControllerExchange(config, ControllerConfig(), MpcConfig(time_limit=0.0), None)
    goals = MotionExchange(config, tip_of(config), MotionConfig(), PERIOD, exchange)
    assert goals.on_move_tip(request_to(0.3))[0].reason == "no model yet"
    exchange.on_model(model_to_msg(model))
    assert goals.on_cancel(CancelMotion.Request())[0].reason == "no state yet"
    exchange.on_modal_state(state(model, 0))
    assert goals.on_move_tip(request_to(0.3))[0].reason == "guard is not armed"


def test_a_pose_survives_the_way_through_its_message():
    pose = np.eye(4)
    pose[:3, :3] = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    pose[:3, 3] = 0.1, -0.2, 0.3
    np.testing.assert_allclose(pose_from_msg(pose_to_msg(pose)), pose, atol=1e-15)


def test_a_reference_beyond_the_torque_is_slowed_down_there_and_told_by_default(config, model):
    exchange, _ = arm_of(config, model)
    text = answer(exchange, swing(0.8, 0.3))
    assert text.startswith("reference accepted: 3 points; slowed down where torque is short, ends 0.")
    assert "axis base.rz: torque" in text and "is beyond the limit 2 N m at" in text
    late = float(text.split(" ends ")[1].split(" s ")[0])
    assert exchange.controller.reference.t[-1] == pytest.approx(0.305 + late, abs=1e-3) and late > 0.02


def test_or_followed_or_refused_or_stretched_if_asked(config, model):
    plain, _ = arm_of(config, model, excess="tell")
    text = answer(plain, swing(0.8, 0.3))
    assert text.startswith("reference accepted: 3 points; the arm will lag: axis base.rz: torque")
    assert plain.controller.reference.t[-1] == pytest.approx(0.305)
    strict, _ = arm_of(config, model, excess="refuse")
    assert answer(strict, swing(0.8, 0.3)).startswith("reference refused: axis base.rz: torque")
    patient, _ = arm_of(config, model, excess="stretch")
    text = answer(patient, swing(0.8, 0.3))
    assert text.startswith("reference accepted: 3 points; stretched in time by 1.")
    length = patient.controller.reference.t[-1] - 0.005
    factor = float(text.split(" by ")[1].split(":")[0])
    assert length == pytest.approx(0.3 * factor, rel=1e-3) and factor > 1.1
    fast = swing(2.8, 0.5)  # 11.2 rad/s, 6 are allowed
    assert "velocity 11.2 rad/s is beyond the limit 6 rad/s at 0.250 s" in answer(strict, fast)


def test_a_reference_of_hours_is_refused(config, model):
    exchange, _ = arm_of(config, model)
    days = answer(exchange, swing(0.1, 2.0**31 - 1.0))
    assert days == "reference refused: it takes 2.14748e+09 s, at most 3600 s are allowed"


def own_stamp(outgoing):
    (sent,) = told(outgoing, "reference")
    return sent.header.stamp.sec * 1_000_000_000 + sent.header.stamp.nanosec


def reasons(outgoing):
    return [msg.reason for msg in told(outgoing, "controller_status")]


REFUSAL = "no model at this pose: the loops do not close"
NO_MODELS = f"reference refused: no models for it: {REFUSAL}"


@pytest.mark.parametrize("is_quicker", [False, True])
def test_a_motion_without_models_ends_at_rest(config, model, is_quicker):
    """The model node may be quicker than the controller."""
    exchange, goals = arm_of(config, model)
    msg = reference_to_msg(swing(0.3, 1.0), ("base.rz",), EPOCH + PERIOD_NS)
    heard = [
        lambda: goals.on_reference(msg),
        lambda: goals.on_models(f"{EPOCH + PERIOD_NS}: refused: {REFUSAL}"),
    ]
    first, second = (hear() for hear in (reversed(heard) if is_quicker else heard))
    assert NO_MODELS in reasons(second)
    assert NO_MODELS not in reasons(first)
    assert abs(exchange.controller.reference.position(2.0)[0]) < 1e-3  # rad; it had hardly begun
    (halt,) = told(second, "reference")
    assert halt.header.frame_id == OWN_FRAME


def test_a_goal_without_models_is_given_up(config, model):
    exchange, goals = arm_of(config, model)
    _, outgoing = goals.on_move_tip(request_to(0.3))
    said = goals.on_models(f"{own_stamp(outgoing)}: refused: {REFUSAL}")
    assert NO_MODELS in reasons(said)
    assert abs(exchange.controller.reference.position(9.0)[0]) < 0.01  # rad
    (again,) = reasons(goals.on_models(f"{own_stamp(said)}: refused: {REFUSAL}"))  # of the halt
    assert again == f"{NO_MODELS}; it is stopping already"


def test_a_refusal_of_models_for_another_reference_changes_nothing(config, model):
    exchange, goals = arm_of(config, model)
    goals.on_reference(reference_to_msg(swing(0.3, 1.0), ("base.rz",), EPOCH + PERIOD_NS))
    for text in (
        f"{EPOCH}: refused: {REFUSAL}",
        f"{EPOCH + PERIOD_NS}: 3 ab12",
        "",
        "refused: x",
        "-1: refused: x",
        f"{'9' * 5000}: refused: x",  # of which Python makes no number
    ):
        assert goals.on_models(text) == []
    assert exchange.controller.reference.position(2.0)[0] == pytest.approx(0.3)


def test_a_reference_without_models_is_not_followed_after_arming(config, model):
    exchange, goals = arm_of(config, model)
    exchange.on_guard_status(GuardStatus(session_token=0))
    goals.on_reference(reference_to_msg(swing(0.3, 1.0), ("base.rz",), EPOCH + PERIOD_NS))
    assert NO_MODELS in reasons(goals.on_models(f"{EPOCH + PERIOD_NS}: refused: {REFUSAL}"))
    assert exchange.controller.reference is None


SILENCE = "reference refused: no models for it: 0.5 s after its begin the model node has said nothing"


@pytest.mark.parametrize("is_goal", [True, False])
def test_a_motion_of_which_the_model_node_says_nothing_ends_at_rest(config, model, is_goal):
    """With a frozen node the law went on with the model of another pose, and a sound sensor was blamed."""
    exchange, goals = arm_of(config, model)
    goals.has_models = lambda: True
    if is_goal:
        goals.on_move_tip(request_to(1.5, duration=2.0))
    else:
        goals.on_reference(reference_to_msg(swing(1.5, 2.0), ("base.rz",), EPOCH + PERIOD_NS))
    exchange.on_modal_state(state(model, 101))
    assert SILENCE not in reasons(goals.update())
    exchange.on_modal_state(state(model, 102))
    said = goals.update()
    assert SILENCE in reasons(said)
    assert told(said, "reference")[0].header.frame_id == OWN_FRAME
    assert exchange.controller.reference.position(9.0)[0] < 0.6  # rad
    exchange.on_modal_state(state(model, 400))
    last = goals.update()
    assert not told(last, "reference")  # the way to rest awaits nobody
    if is_goal:  # nobody had canceled it
        (ended,) = told(last, "motion_status")
        assert (ended.state, ended.reason) == (
            MotionStatus.ABORTED,
            SILENCE.removeprefix("reference refused: "),
        )


def waiting(begin_k):
    """Return the message of a reference from 0.3 rad that begins in a period to come."""
    t, theta = np.array([0.0, 1.0]), np.array([[0.3], [0.0]])
    return reference_to_msg(Reference.through(t, theta), ("base.rz",), EPOCH + begin_k * PERIOD_NS)


def test_a_goal_is_reached_and_settles_while_a_reference_waits_for_its_begin(config, model):
    """It was aborted at once, and the axes turned to where the reference begins."""
    exchange, goals = arm_of(config, model)
    goals.on_move_tip(request_to(0.3))
    said = reasons(goals.on_reference(waiting(400)))
    assert said == ["reference accepted: 2 points; the motion under way ends first, this one begins in 2 s"]
    ends = []
    for k in range(1, 420):
        there = state(model, k)
        there.theta = exchange.controller.reference.position(k * PERIOD).tolist()
        exchange.on_modal_state(there)
        ends += [m.state for m in told(goals.update(), "motion_status") if m.state != MotionStatus.EXECUTING]
    assert ends == [MotionStatus.SUCCEEDED]
    assert exchange.controller.reference.position(9.0)[0] == 0.0


def test_the_models_of_a_motion_are_waited_for_also_while_another_one_waits(config, model):
    exchange, goals = arm_of(config, model)
    goals.has_models = lambda: True
    goals.on_reference(reference_to_msg(swing(0.3, 1.8), ("base.rz",), EPOCH + PERIOD_NS))
    goals.on_reference(waiting(400))
    goals.on_models(f"{EPOCH + 400 * PERIOD_NS}: 3 ab12")
    exchange.on_modal_state(state(model, 102))
    assert SILENCE in reasons(goals.update())
    assert exchange.controller.reference.position(9.0)[0] < 0.25  # rad; nothing waits any more


def test_a_reference_that_waits_and_has_no_models_ends_what_is_under_way(config, model):
    exchange, goals = arm_of(config, model)
    goals.on_reference(reference_to_msg(swing(0.3, 1.8), ("base.rz",), EPOCH + PERIOD_NS))
    goals.on_reference(waiting(400))
    assert NO_MODELS in reasons(goals.on_models(f"{EPOCH + 400 * PERIOD_NS}: refused: {REFUSAL}"))
    assert exchange.controller.reference.position(9.0)[0] < 0.1  # rad


@pytest.mark.parametrize("is_told", [True, False])
def test_a_motion_goes_on_once_its_models_are_told_and_where_nobody_ever_tells_them(config, model, is_told):
    exchange, goals = arm_of(config, model)
    goals.has_models = lambda: is_told
    _, outgoing = goals.on_move_tip(request_to(1.5, duration=2.0))
    if is_told:
        goals.on_models(f"{own_stamp(outgoing)}: 3 ab12")
    exchange.on_modal_state(state(model, 150))
    assert not reasons(goals.update())
    assert exchange.controller.reference.position(9.0)[0] == pytest.approx(1.5, abs=1e-6)


@pytest.mark.parametrize("is_quicker", [False, True])
def test_a_motion_goes_on_while_other_references_are_refused(config, model, is_quicker):
    """The newest word was of another one then, and the model node was taken for silent."""
    exchange, goals = arm_of(config, model)
    goals.has_models = lambda: True
    msg = reference_to_msg(swing(1.5, 2.0), ("base.rz",), EPOCH + PERIOD_NS)
    heard = [lambda: goals.on_reference(msg), lambda: goals.on_models(f"{EPOCH + PERIOD_NS}: 3 ab12")]
    for hear in reversed(heard) if is_quicker else heard:
        hear()
    exchange.on_modal_state(state(model, 200))
    refused = reference_to_msg(swing(0.3, 1.0), ("base_rz",), EPOCH + 300 * PERIOD_NS)
    assert reasons(goals.on_reference(refused))[0].startswith("reference refused: joint_names are")
    assert goals.on_models(f"{EPOCH + 300 * PERIOD_NS}: refused: joint_names are ['base_rz']") == []
    exchange.on_modal_state(state(model, 210))
    assert not told(goals.update(), "reference")
    assert exchange.controller.reference.position(9.0)[0] == pytest.approx(1.5, abs=1e-6)


def test_who_waits_for_a_goal_hears_why_the_guard_has_stopped_the_arm(config, model):
    exchange, goals = arm_of(config, model)
    goals.on_move_tip(request_to(0.3))
    exchange.on_guard_status(GuardStatus(session_token=0, reason="stopped by ~/stop"))
    (last,) = told(goals.update(), "motion_status")
    assert (last.state, last.reason) == (MotionStatus.ABORTED, "the arm was stopped: stopped by ~/stop")


def test_the_last_word_on_a_goal_is_said_before_the_controller_goes(config, model):
    """Nothing was: who waited for its end waited for ever."""
    _, goals = arm_of(config, model)
    goals.on_move_tip(request_to(0.3))
    (last,) = told(goals.end("the controller is not active any more"), "motion_status")
    assert (last.goal_id, last.state) == (1, MotionStatus.ABORTED)
    assert last.reason == "the controller is not active any more"
    assert goals.end("again") == [] and goals.update() == []


def test_a_reference_of_another_clock_is_refused_by_how_far_it_is_ahead(config, model):
    """One stamped 2038 was accepted, and waited for."""
    exchange, goals = arm_of(config, model)
    for late_ns, words in (
        (3600 * 10**9, "reference accepted"),
        (3601 * 10**9, "it begins 3.6e+03 s after the"),
    ):
        said = goals.on_reference(reference_to_msg(swing(0.1, 1.0), ("base.rz",), EPOCH + late_ns))
        assert words in reasons(said)[0]


def test_nothing_is_pursued_for_a_guard_that_has_died(config, model):
    """Its last word was that commands pass, so a goal was taken and waited for until its time was over."""
    exchange, goals = arm_of(config, model)
    assert goals.on_move_tip(request_to(1.0, duration=3.0))[0].accepted
    k = 0
    while not (said := [m for m in told(goals.update(), "motion_status") if m.state == MotionStatus.ABORTED]):
        k += 1
        exchange.on_modal_state(state(model, k))
    assert k * PERIOD == pytest.approx(0.505)
    assert (said[0].goal_id, said[0].reason) == (1, "the guard has said nothing for 0.51 s")
    brought_to_rest = exchange.controller.reference
    assert brought_to_rest.theta_dot[-1, 0] == 0.0 and brought_to_rest.position(10.0)[0] < 0.9
    assert goals.update() == []
    response, outgoing = goals.on_move_tip(request_to(0.3))
    assert (response.accepted, response.reason) == (False, "the guard has said nothing for 0.51 s")
    assert exchange.controller.reference is brought_to_rest
    exchange.on_guard_status(GuardStatus(session_token=5))
    assert goals.on_move_tip(request_to(0.3))[0].accepted  # it was the network, and commands went on
    assert told([*exchange.on_modal_state(state(model, k + 1))], "joint_commands")[0].sequence == k + 2


def test_a_reference_that_waits_for_the_guard_can_be_taken_back(config, model):
    """It was refused, for the guard was not armed; an hour later, armed, the arm went where it led."""
    exchange, goals = arm_of(config, model)
    exchange.on_guard_status(GuardStatus(reason="stopped by ~/stop"))
    goals.on_reference(reference_to_msg(swing(0.3, 1.0), ("base.rz",), EPOCH + 5 * 10**9))
    assert exchange.controller.reference is not None
    refused, _ = goals.on_cancel(CancelMotion.Request(goal_id=3))
    assert (refused.accepted, refused.reason) == (False, "guard is not armed")
    response, said = goals.on_cancel(CancelMotion.Request())
    assert response.accepted and exchange.controller.reference is None
    assert reasons(said) == ["reference dropped: canceled before the guard was armed"]
    again, _ = goals.on_cancel(CancelMotion.Request())
    assert (again.accepted, again.reason) == (False, "guard is not armed")


@pytest.mark.parametrize(("begins", "is_told"), [(5.0, True), (0.0, False)])
def test_a_stop_before_a_reference_begins_is_the_end_of_it_and_said(config, model, begins, is_told):
    exchange, goals = arm_of(config, model)
    begin_ns = EPOCH + PERIOD_NS + round(begins * 1e9)
    asked = reference_to_msg(swing(0.3, 1.0), ("base.rz",), begin_ns)
    assert "accepted" in reasons(goals.on_reference(asked))[0]
    for k in (1, 2):
        exchange.on_modal_state(state(model, k))
    said = exchange.on_guard_status(GuardStatus(reason="stopped by stop"))
    assert reasons(said) == ["reference dropped: the guard stopped before it began"] * is_told


def test_a_goal_that_is_given_up_for_a_lost_state_does_not_blame_the_guard(config, model):
    exchange, goals = arm_of(config, model)
    goals.on_move_tip(request_to(1.0, duration=3.0))
    last, k = None, 0
    while last is None:
        k += 1
        lost = state(model, k)
        lost.status, lost.reason = ModalState.LOST, "no sensor is usable"
        exchange.on_guard_status(GuardStatus(session_token=5))
        exchange.on_modal_state(lost)
        ended = [m for m in told(goals.update(), "motion_status") if m.state == MotionStatus.ABORTED]
        last = ended[0] if ended else None
    assert last.reason == "estimator: no sensor is usable: the motion is given up"


def test_what_is_refused_is_told_to_who_listens_too(config, model):
    exchange, goals = arm_of(config, model)
    exchange.on_guard_status(GuardStatus(session_token=0))
    for request, reason in (
        (request_to(0.3), "guard is not armed"),
        (request_to(float("nan")), goals.on_move_tip(request_to(float("nan")))[0].reason),
    ):
        response, said = goals.on_move_tip(request)
        assert (response.accepted, response.reason) == (False, reason)
        (status,) = told(said, "motion_status")
        assert (status.state, status.reason) == (MotionStatus.REJECTED, reason)


@pytest.mark.parametrize("epoch_ns", [0, 1_795_893_067_123_456_789])
def test_goals_that_are_as_fast_as_an_axis_may_be_are_not_too_fast_by_rounded_stamps(epoch_ns):
    """A quarter of them was refused: "velocity 4 rad/s is beyond the limit 4 rad/s"."""
    config = load_config(Path(__file__).parents[3] / "docs" / "two_link.yaml")
    tree = ReducedTree(config)
    served, tip, motion = linearize(tree), tip_of(config), MotionConfig()
    rng = np.random.default_rng(0)
    for way in rng.uniform(-1.2, 1.2, (30, 2)):
        exchange = ControllerExchange(
            config, ControllerConfig(), MpcConfig(time_limit=0.0), None, motion=motion
        )
        goals = MotionExchange(config, tip, motion, PERIOD, exchange)
        exchange.on_model(model_to_msg(served))
        exchange.on_guard_status(GuardStatus(session_token=5))
        msg = ModalState(model_id=served.model_id, status=ModalState.OK, theta=[*config.home])
        msg.header.stamp = ns_to_stamp(epoch_ns)
        msg.theta_dot, msg.disturbance = [0.0] * 2, [0.0] * 2
        msg.eta, msg.eta_dot = [0.0] * served.n_eta, [0.0] * served.n_eta
        exchange.on_modal_state(msg)
        request = MoveTip.Request()
        place = tip.at_rest(np.array(config.home) + way)
        request.target.position.x, request.target.position.y = float(place[0]), float(place[1])
        response, _ = goals.on_move_tip(request)
        assert response.accepted, response.reason
