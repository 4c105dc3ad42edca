"""The controller between messages: sessions, models, references, missed cycles."""

import math
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("flexarm_interfaces.msg")

from flexarm_interfaces.msg import ControllerStatus, GuardStatus, ModalState  # noqa: E402

from flexarm_controller.command_writer import CommandWriter  # noqa: E402
from flexarm_controller.controller import Controller  # noqa: E402
from flexarm_controller.conversions import command_to_msg, reference_to_msg, state_from_msg  # noqa: E402
from flexarm_controller.debug import Insight  # noqa: E402
from flexarm_controller.exchange import ControllerExchange  # noqa: E402
from flexarm_controller.limits import limits_of  # noqa: E402
from flexarm_controller.program import riccati  # noqa: E402
from flexarm_controller.reference import Reference, hold  # noqa: E402
from flexarm_controller.settings import ControllerConfig, MpcConfig  # noqa: E402
from flexarm_controller.time_budget import Clocks  # noqa: E402
from flexarm_controller.told_state import SentState  # noqa: E402
from flexarm_model.conversions import model_to_msg, ns_to_stamp  # noqa: E402
from flexarm_model.reading.config import load_config  # noqa: E402
from flexarm_model.reading.manipulator_file import find_manipulator  # noqa: E402
from flexarm_model.served.linearize import linearize  # noqa: E402
from flexarm_model.tree.reduced_tree import ReducedTree  # noqa: E402

PERIOD_NS = 5_000_000


@pytest.fixture(scope="module")
def config():
    return load_config(find_manipulator("single_link"), "geared")


@pytest.fixture(scope="module")
def model(config):
    return linearize(ReducedTree(config))


@pytest.fixture
def exchange(config):
    return ControllerExchange(
        config, ControllerConfig(), MpcConfig(time_limit=0.0), None, Clocks(cpu=lambda: 0.0)
    )


def state(model, k, **changes):
    msg = ModalState(model_id=model.model_id, status=ModalState.OK)
    msg.header.stamp = ns_to_stamp(1_000_000_000 + k * PERIOD_NS)
    fields = {
        "theta": [0.1],
        "theta_dot": [0.0],
        "disturbance": [0.0],
        "eta": [0.0] * 3,
        "eta_dot": [0.0] * 3,
    }
    for name, value in (fields | changes).items():
        setattr(msg, name, value)
    return msg


def answers(outgoing):
    return {out.topic: out.msg for out in outgoing}


def test_without_a_model_or_a_session_no_command_leaves(exchange, model):
    assert set(answers(exchange.on_modal_state(state(model, 0)))) == {"controller_status"}
    exchange.on_model(model_to_msg(model))
    told = answers(exchange.on_modal_state(state(model, 1)))
    assert set(told) == {"controller_status"}
    assert (told["controller_status"].mode, told["controller_status"].reason) == (0, "guard is not armed")


def test_commands_quote_the_session_and_count_from_one_in_each(exchange, model):
    exchange.on_model(model_to_msg(model))
    for token in (11, 12):
        exchange.on_guard_status(GuardStatus(session_token=token))
        for k in (1, 2):
            command = answers(exchange.on_modal_state(state(model, 10 * token + k)))["joint_commands"]
            assert (command.session_token, command.sequence, command.model_id) == (token, k, model.model_id)
            assert command.header.stamp == state(model, 10 * token + k).header.stamp
        exchange.on_guard_status(GuardStatus(session_token=0))


def test_an_arm_with_weight_whose_state_is_lost_is_left_to_the_guard():
    """No command for it, and its answer says so from 0.1 s on; that of an arm without weight never does."""
    heavy = load_config(find_manipulator("variable_stiffness"))
    exchange = ControllerExchange(heavy, ControllerConfig(), MpcConfig(time_limit=0.0), None)
    model = linearize(ReducedTree(heavy), next(iter(heavy.poses.values())))
    exchange.on_model(model_to_msg(model))
    exchange.on_guard_status(GuardStatus(session_token=3))
    zeros = {name: [0.0] * 3 for name in ("theta_dot", "disturbance")}
    modes = {name: [0.0] * model.n_eta for name in ("eta", "eta_dot")}
    left, sent = [], []
    for k in range(40):
        told = state(model, k, theta=model.pose.tolist(), **zeros, **modes)
        told.status = ModalState.OK if k < 10 else ModalState.LOST
        sent.append("joint_commands" in answers(exchange.on_modal_state(told)))
        left.append(exchange.answer.is_left)
    assert sent == [True] * 30 + [False] * 10 and left == [False] * 30 + [True] * 10
    assert exchange.answer.mode == "inactive" and "the motion is given up" in exchange.answer.reason


def test_gains_are_told_while_somebody_wants_them(exchange, model):
    exchange.on_model(model_to_msg(model))
    exchange.on_guard_status(GuardStatus(session_token=3))
    assert "feedback_gains" not in answers(exchange.on_modal_state(state(model, 0)))
    insight = Insight(lambda q: np.zeros(3), MpcConfig(), ControllerConfig().period)
    exchange.teller.tell_more(insight, lambda topic: topic == "feedback_gains")
    told = answers(exchange.on_modal_state(state(model, 1)))
    gains, command = told["feedback_gains"], told["joint_commands"]
    assert (gains.model_id, gains.header.stamp) == (model.model_id, command.header.stamp)
    assert (gains.acts_at, list(gains.effort)) == (command.acts_at, list(command.effort))
    assert (len(gains.x), len(gains.gain)) == (2 * model.n, 2 * model.n * model.n_theta)
    assert gains.gain[0] < 0.0 and gains.gain[model.n] < 0.0  # more angle or speed, less torque


def test_the_predicted_motion_is_told_20_times_a_second_and_begins_when_the_plan_acts(exchange, model):
    exchange.on_model(model_to_msg(model))
    exchange.on_guard_status(GuardStatus(session_token=3))
    config = MpcConfig()
    insight = Insight(lambda q: np.zeros(3), config, ControllerConfig().period)
    exchange.teller.tell_more(insight, lambda topic: topic == "predicted")
    told = [answers(exchange.on_modal_state(state(model, k, theta_dot=[0.4]))) for k in range(31)]
    assert [k for k, each in enumerate(told) if "predicted" in each] == [0, 10, 20, 30]
    command, predicted = (told[20][topic] for topic in ("joint_commands", "predicted"))
    assert predicted.header.stamp == command.acts_at and predicted.joint_names == command.names
    assert len(predicted.points) == config.horizon + 1
    assert list(predicted.points[0].effort) == pytest.approx(list(command.effort))
    lead = 0.4 * config.delay_periods * ControllerConfig().period  # rad
    assert predicted.points[0].positions[0] == pytest.approx(0.1 + lead, abs=5e-4)
    assert abs(predicted.points[-1].velocities[0]) < 0.4  # it is brought to rest
    seconds = [point.time_from_start.sec + 1e-9 * point.time_from_start.nanosec for point in predicted.points]
    assert np.diff(seconds) == pytest.approx(np.full(config.horizon, ControllerConfig().period))


@pytest.mark.parametrize("heard", [(5, 0, 6), (5, 6)], ids=["stop heard", "stop missed"])
def test_a_motion_does_not_outlive_its_session(exchange, model, heard):
    exchange.on_model(model_to_msg(model))
    exchange.on_modal_state(state(model, 0))
    exchange.on_guard_status(GuardStatus(session_token=heard[0]))
    exchange.controller.follow(hold(np.array([0.5])))
    for token in heard[1:]:
        exchange.on_guard_status(GuardStatus(session_token=token))
    status = answers(exchange.on_modal_state(state(model, 1)))["controller_status"]
    assert status.tracking_error[0] == pytest.approx(0.0)  # it holds where it is, 0.1, not the old 0.5


def test_a_model_of_another_preset_is_refused_by_name(exchange, config, model):
    other = linearize(ReducedTree(load_config(find_manipulator("single_link"), "light_hub")))
    told = answers(exchange.on_model(model_to_msg(other)))["controller_status"]
    assert config.config_id in told.reason and other.config_id in told.reason and "geared" in told.reason
    assert exchange.controller is None


def test_a_model_that_was_changed_on_its_way_is_refused(exchange, model):
    msg = model_to_msg(model)
    msg.mass[0] += 1.0
    assert "model_id" in answers(exchange.on_model(msg))["controller_status"].reason
    assert exchange.controller is None


def test_a_state_of_another_model_brakes(exchange, model):
    exchange.on_model(model_to_msg(model))
    exchange.on_guard_status(GuardStatus(session_token=5))
    told = answers(exchange.on_modal_state(state(model, 1, model_id="stale", theta_dot=[1.0])))
    assert told["controller_status"].mode == ControllerStatus.DAMPING
    assert "stale" in told["controller_status"].reason
    assert told["joint_commands"].effort[0] < 0.0


def test_references_are_answered_at_once_with_the_reason(exchange, model):
    inside = reference_to_msg(replace(hold(np.array([0.11])), t=np.array([2.0])), ("base.rz",), 0)
    outside = reference_to_msg(replace(hold(np.array([4.0])), t=np.array([2.0])), ("base.rz",), 0)
    assert "refused" in answers(exchange.on_reference(inside))["controller_status"].reason
    exchange.on_model(model_to_msg(model))
    assert "no state yet" in answers(exchange.on_reference(inside))["controller_status"].reason
    exchange.on_modal_state(state(model, 0))
    assert "joint limits" in answers(exchange.on_reference(outside))["controller_status"].reason
    assert (
        answers(exchange.on_reference(inside))["controller_status"].reason == "reference accepted: 1 points"
    )


def slow_move(begin, theta=1.5):
    """Return the message of a move of 10 s to ``theta`` that begins so long after the first state [s]."""
    return reference_to_msg(
        Reference.through([begin, begin + 10.0], [[0.1], [theta]]),
        ("base.rz",),
        1_000_000_000,
    )


@pytest.mark.parametrize(
    ("begin", "words"),
    [
        (2.3, "; the motion under way is cut off when this one begins, in 2.3 s"),
        (12.0, "; the motion under way ends first, this one begins in 12 s"),
        (0.0, ""),
    ],
)
def test_a_reference_that_waits_for_its_begin_says_so(exchange, model, begin, words):
    exchange.on_model(model_to_msg(model))
    exchange.on_guard_status(GuardStatus(session_token=5, mode=GuardStatus.ARMED))
    exchange.on_modal_state(state(model, 0))
    said = [answers(exchange.on_reference(slow_move(at)))["controller_status"].reason for at in (0.0, begin)]
    assert said == ["reference accepted: 2 points", f"reference accepted: 2 points{words}"]


@pytest.mark.parametrize(("begin", "is_taken"), [(5.0, True), (0.9, True), (0.0, False), (-20.0, False)])
def test_a_reference_that_began_long_ago_is_refused_and_not_run_after(exchange, model, begin, is_taken):
    exchange.on_model(model_to_msg(model))
    exchange.on_guard_status(GuardStatus(session_token=3))
    exchange.on_modal_state(state(model, 200))  # at 1 s
    answer = answers(exchange.on_reference(slow_move(begin)))["controller_status"].reason
    assert answer.startswith("reference accepted") == is_taken
    assert is_taken or "before the newest state, 0.2 s are allowed" in answer


@pytest.mark.parametrize(("back", "is_kept"), [(75, True), (99, True), (180, False)])
def test_a_reference_that_begins_while_the_state_is_lost_is_dropped_and_told_once(
    exchange, model, back, is_kept
):
    """It begins in period 80; 0.1 s late it may be."""
    exchange.on_model(model_to_msg(model))
    exchange.on_guard_status(GuardStatus(session_token=3))
    told = []
    for k in range(200):
        if k == 60:
            answer = answers(exchange.on_reference(slow_move(0.4)))["controller_status"].reason
            assert answer.startswith("reference accepted")
        status = ModalState.LOST if 10 <= k < back else ModalState.OK
        sent = exchange.on_modal_state(state(model, k, status=status))
        told += [(k, out.msg.reason) for out in sent if out.topic == "controller_status"]
    dropped = {k: reason for k, reason in told if reason.startswith("reference")}
    reason = "reference dropped: it began 0.105 s ago, when the state was lost"
    assert dropped == ({} if is_kept else {101: reason})
    assert exchange.controller.reference.theta[-1, 0] == pytest.approx(1.5 if is_kept else 0.1)


@pytest.mark.parametrize(("armed_at", "is_kept"), [(0.8, True), (20.0, False)])
def test_a_reference_that_began_before_anybody_was_armed_is_dropped(exchange, model, armed_at, is_kept):
    exchange.on_model(model_to_msg(model))
    exchange.on_modal_state(state(model, 0))
    assert "accepted" in answers(exchange.on_reference(slow_move(0.8)))["controller_status"].reason
    exchange.on_modal_state(state(model, round(200 * armed_at) - 1))
    told = answers(exchange.on_guard_status(GuardStatus(session_token=3)))
    assert is_kept == (told == {})
    assert is_kept or "reference dropped: it began 19.2 s ago" in told["controller_status"].reason
    exchange.on_modal_state(state(model, round(200 * armed_at)))
    goal = exchange.controller.reference.theta[-1, 0]
    assert goal == pytest.approx(1.5 if is_kept else 0.1)


def test_a_state_that_comes_twice_or_too_late_is_not_answered(exchange, model):
    exchange.on_model(model_to_msg(model))
    exchange.on_guard_status(GuardStatus(session_token=3))
    told = [answers(exchange.on_modal_state(state(model, k))) for k in (5, 5, 3, 6)]
    assert ["joint_commands" in each for each in told] == [True, False, False, True]
    assert told[3]["joint_commands"].sequence == 2 and told[1] == {}
    back = answers(exchange.on_modal_state(state(model, -100)))  # the clock was set back by half a second
    assert "joint_commands" in back


def test_missed_cycles_are_counted_and_skipped(exchange, model):
    exchange.on_model(model_to_msg(model))
    exchange.on_guard_status(GuardStatus(session_token=5))
    missed = []
    for k in (1, 2, 5, 6, 16):
        told = answers(exchange.on_modal_state(state(model, k)))
        assert told["joint_commands"].header.stamp == state(model, k).header.stamp
        missed.append(told["controller_status"].missed_cycles)
    assert missed == [0, 0, 2, 2, 11]


def test_what_is_counted_is_told_with_notices_and_while_nobody_is_armed_too(exchange, model):
    """Who plots it saw it fall to zero with every reference and every stop."""
    exchange.on_model(model_to_msg(model))
    exchange.on_guard_status(GuardStatus(session_token=5))
    for k in (1, 4):
        exchange.on_modal_state(state(model, k))
    (notice,) = exchange.on_reference(slow_move(5.0))
    exchange.on_guard_status(GuardStatus(session_token=0))
    told = answers(exchange.on_modal_state(state(model, 5)))["controller_status"]
    assert [notice.msg.missed_cycles, told.missed_cycles] == [2, 2]
    assert (notice.msg.mode, told.mode, told.reason) == (0, 0, "guard is not armed")


def test_ten_thousand_malformed_states_never_raise_nor_leave_the_limits(exchange, model):
    exchange.on_model(model_to_msg(model))
    exchange.on_guard_status(GuardStatus(session_token=5))
    rng = np.random.default_rng(1)
    special = [float("nan"), float("inf"), -float("inf"), 1e308, 5e-324]
    for k in range(1, 10_001):
        changes = {}
        for name, length in (("theta", 1), ("theta_dot", 1), ("disturbance", 1), ("eta", 3), ("eta_dot", 3)):
            if rng.random() < 0.3:
                size = length if rng.random() < 0.7 else int(rng.integers(0, 5))
                changes[name] = [float(rng.choice(special)) for _ in range(size)]
        told = answers(exchange.on_modal_state(state(model, k, **changes)))
        effort = told["joint_commands"].effort
        assert len(effort) == 1 and abs(effort[0]) <= 28.0


def test_a_model_is_adopted_at_the_first_state_at_or_after_its_stamp(exchange, config, model):
    later = linearize(ReducedTree(config), np.array([0.2]))
    exchange.on_model(model_to_msg(model))
    exchange.on_guard_status(GuardStatus(session_token=5))
    exchange.on_model(model_to_msg(later, 1_000_000_000 + 2 * PERIOD_NS + 1))
    used = [answers(exchange.on_modal_state(state(m, k))) for k, m in enumerate([model] * 3 + [later] * 2)]
    assert [told["joint_commands"].model_id for told in used] == [model.model_id] * 3 + [later.model_id] * 2
    assert all(told["controller_status"].mode == ControllerStatus.MPC for told in used)


def test_a_state_of_a_model_whose_time_has_not_come_is_refused(exchange, config, model):
    later = linearize(ReducedTree(config), np.array([0.2]))
    exchange.on_model(model_to_msg(model))
    exchange.on_guard_status(GuardStatus(session_token=5))
    exchange.on_model(model_to_msg(later, 1_000_000_000 + 9 * PERIOD_NS))
    status = answers(exchange.on_modal_state(state(later, 1)))["controller_status"]
    assert status.mode in (ControllerStatus.DAMPING, ControllerStatus.HOLD)
    assert later.model_id in status.reason


def test_an_adopted_model_that_was_prepared_commands_what_one_built_at_once_does(exchange, config, model):
    later = linearize(ReducedTree(config), np.array([0.2]))
    exchange.on_model(model_to_msg(model))
    exchange.on_guard_status(GuardStatus(session_token=5))
    exchange.on_model(model_to_msg(later, 1_000_000_000 + PERIOD_NS))
    at_once = Controller(
        model, limits_of(config), ControllerConfig(), MpcConfig(time_limit=0.0), Clocks(cpu=lambda: 0.0)
    )
    for k, m in enumerate([model, later, later]):
        if k == 1:
            at_once.adopt(later)
        command = answers(exchange.on_modal_state(state(m, k)))["joint_commands"]
        expected = at_once.step(state_from_msg(state(m, k), m, 1_000_000_000))
        assert command.effort[0] == expected.tau[0]


def test_models_that_wait_are_foreseen_at_their_stamps(config, model):
    """From the first state on, which sets time zero; whoever is adopted or void is foreseen no more."""
    mpc = MpcConfig(time_limit=0.0, foresight=True)
    exchange = ControllerExchange(config, ControllerConfig(), mpc, None, Clocks(cpu=lambda: 0.0))
    seen = []
    exchange.on_model(model_to_msg(model))
    exchange.controller.foresee = seen.append
    tree = ReducedTree(config)
    later = [linearize(tree, np.array([angle])) for angle in (0.2, 0.4, 0.6)]
    for k, coming in zip((20, 60), later, strict=False):
        exchange.on_model(model_to_msg(coming, 1_000_000_000 + k * PERIOD_NS))
    assert not seen  # nobody knows yet when time zero is
    exchange.on_modal_state(state(model, 0))
    exchange.on_model(model_to_msg(later[2], 1_000_000_000 + 40 * PERIOD_NS))  # voids the one at 60
    told = [[(round(t / 0.005), coming.model_id) for t, coming in schedule] for schedule in seen]
    first, second, third = (coming.model_id for coming in later)
    assert told == [[(20, first), (60, second)], [(20, first), (40, third)]]


def test_foreseen_models_change_the_plan_before_they_hold(config, model):
    tree, torques = ReducedTree(config), {}
    heavier = replace(linearize(tree), M=model.M + np.diag([0.3, 0.0, 0.0, 0.0]))
    for foresight in (False, True):
        mpc = MpcConfig(time_limit=0.0, foresight=foresight)
        exchange = ControllerExchange(config, ControllerConfig(), mpc, None, Clocks(cpu=lambda: 0.0))
        exchange.on_model(model_to_msg(model))
        exchange.on_model(model_to_msg(heavier, 1_000_000_000 + 10 * PERIOD_NS))
        exchange.on_guard_status(GuardStatus(session_token=3))
        exchange.on_modal_state(state(model, 0))
        bent = state(model, 1, eta=[1e-3, 0.0, 0.0])
        torques[foresight] = answers(exchange.on_modal_state(bent))["joint_commands"].effort[0]
    assert abs(torques[True] - torques[False]) > 1e-3


def test_of_many_states_a_second_every_change_of_the_answer_is_told_and_else_200(config, model):
    period = 1_000_000
    settings = ControllerConfig(period=1e-9 * period)
    exchange = ControllerExchange(config, settings, MpcConfig(time_limit=0.0), None, Clocks(cpu=lambda: 0.0))
    exchange.on_model(model_to_msg(model))
    told = []
    for k in range(300):
        exchange.on_guard_status(GuardStatus(session_token=5 * (k >= 100)))
        msg = state(model, 0, **({"theta": [math.nan]} if k == 151 else {}))
        msg.header.stamp = ns_to_stamp(1_000_000_000 + k * period)
        sent = answers(exchange.on_modal_state(msg))
        assert ("joint_commands" in sent) == (k >= 100)
        if "controller_status" in sent:
            told.append((k, sent["controller_status"].mode, sent["controller_status"].reason))
    changes = [k for (k, *now), (_, *before) in zip(told[1:], told, strict=False) if now != before]
    assert changes == [100, 151, 152]
    assert [k for k, *_ in told[:3]] == [0, 5, 10]
    assert np.diff([k for k, *_ in told]).max() == 5 and len(told) == 62


def test_in_lockstep_the_status_of_every_answer_is_told(config, model):
    settings = ControllerConfig(period=0.001)
    exchange = ControllerExchange(config, settings, MpcConfig(time_limit=0.0), 0)
    exchange.on_model(model_to_msg(model))
    for k in range(10):
        msg = state(model, 0)
        msg.header.stamp = ns_to_stamp(k * 1_000_000)
        assert "controller_status" in answers(exchange.on_modal_state(msg))


def test_a_command_leaves_before_anything_is_told_of_it(exchange, model):
    exchange.on_model(model_to_msg(model))
    exchange.on_guard_status(GuardStatus(session_token=5))
    assert set(answers(exchange.on_state(SentState(state(model, 1))))) == {"joint_commands"}
    assert set(answers(exchange.tell())) == {"controller_status"}


def test_commands_written_as_bytes_are_the_same(exchange, model):
    serialization = pytest.importorskip("rclpy.serialization", reason="needs ROS")
    written = CommandWriter(lambda msg: bytes(serialization.serialize_message(msg)))

    def write(*arguments):
        sent, msg = written.write(*arguments), command_to_msg(*arguments)
        told = serialization.deserialize_message(sent, type(msg)) if isinstance(sent, bytes) else sent
        assert told == msg
        return sent

    exchange.write = write
    exchange.on_model(model_to_msg(model))
    for token in (5, 2**63 + 1):
        exchange.on_guard_status(GuardStatus(session_token=token))
        for k in range(5):
            sent = answers(exchange.on_modal_state(state(model, token % 1000 + k, theta=[0.01 * k])))
            assert isinstance(sent["joint_commands"], bytes) == (k > 1 or token > 5)


def test_a_model_of_which_no_law_can_be_made_is_refused_and_the_one_before_goes_on(exchange, model):
    """The controller ended by it."""
    exchange.on_model(model_to_msg(model))
    exchange.controller.prepare = _no_law
    said = exchange.on_model(model_to_msg(model, 7))
    assert said[-1].msg.reason == exchange.model_fault == "model refused: Singular matrix"
    assert exchange.controller.model.model_id == model.model_id


def test_a_model_of_other_axes_is_refused_under_the_same_description(exchange, model):
    """It was taken: its commands fitted nobody, and the guard stayed armed."""
    exchange.on_model(model_to_msg(model))
    said = exchange.on_model(model_to_msg(replace(model, theta_names=("x.rz",)), 7))
    assert said[-1].msg.reason == "model refused: its axes are x.rz, those of the controller base.rz"


def _no_law(model):
    raise np.linalg.LinAlgError("Singular matrix")


def _no_solution(*matrices, **more):
    raise np.linalg.LinAlgError(
        "The associated symplectic pencil has eigenvalues too close to the unit circle"
    )


def test_weights_of_which_no_law_can_be_made_are_named(config, model, monkeypatch):
    """A word about a symplectic pencil was all; what is too extreme for SciPy differs with its version."""
    monkeypatch.setattr(riccati, "_double", lambda A, G, H: None)
    monkeypatch.setattr(riccati, "solve_discrete_are", _no_solution)
    extreme = MpcConfig(velocity_error=1e-9, modal_energy=1e-12, time_limit=0.0)
    exchange = ControllerExchange(config, ControllerConfig(), extreme, 0)
    reason = answers(exchange.on_model(model_to_msg(model)))["controller_status"].reason
    assert reason.startswith("model refused: no law can be made with position_error")
    assert "velocity_error 1e-09" in reason and "modal_energy 1e-12" in reason
