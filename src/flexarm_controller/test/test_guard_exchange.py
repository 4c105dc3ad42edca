"""The guard between messages."""

import math
from dataclasses import replace
from functools import cache

import pytest

pytest.importorskip("flexarm_interfaces", reason="needs ROS and flexarm_interfaces")
from flexarm_interfaces.msg import JointCommand, ReducedModel, StrainArray  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402

from flexarm_controller.guard import ARMED, BRAKING, STOPPED  # noqa: E402
from flexarm_controller.guard_exchange import GuardExchange  # noqa: E402
from flexarm_controller.guard_settings import GuardSettings, guard_limits  # noqa: E402
from flexarm_model.conversions import ns_to_stamp  # noqa: E402
from flexarm_model.reading.config import load_config  # noqa: E402
from flexarm_model.reading.manipulator_file import find_manipulator  # noqa: E402
from flexarm_model.served.pending_models import PendingModels  # noqa: E402
from flexarm_model.tree.reduced_tree import ReducedTree  # noqa: E402

T_NS = 5_000_000
EPOCH_NS = 1_700_000_000_000_000_000
TOKEN = 7


@cache
def arm():
    return load_config(find_manipulator("single_link"), "geared")


@cache
def tree():
    return ReducedTree(arm())


@cache
def limits():
    return guard_limits(arm(), tree(), GuardSettings())


@pytest.fixture(autouse=True)
def arm_built_once(monkeypatch):
    def build(config):
        assert config.name == arm().name
        return tree()

    def derive(config, built, settings):
        assert (config.name, built, settings) == (arm().name, tree(), GuardSettings())
        return limits()

    monkeypatch.setattr("flexarm_controller.guard_exchange.ReducedTree", build)
    monkeypatch.setattr("flexarm_controller.guard_exchange.guard_limits", derive)


def state(k, q=0.0, v=0.0, names=("base.rz",)):
    msg = JointState(name=list(names), position=[q] * len(names), velocity=[v] * len(names))
    msg.header.stamp = ns_to_stamp(EPOCH_NS + k * T_NS)
    return msg


def command(k, effort=(1.0,), token=TOKEN, sequence=None, model_id="", delay=0, names=("base.rz",)):
    msg = JointCommand(sequence=k if sequence is None else sequence, session_token=token, model_id=model_id)
    msg.names, msg.effort = list(names), list(effort)
    msg.header.stamp = ns_to_stamp(EPOCH_NS + k * T_NS)
    if delay:
        msg.acts_at = ns_to_stamp(EPOCH_NS + (k + delay) * T_NS)
    return msg


def armed(config=None):
    exchange = GuardExchange(config or arm(), GuardSettings(), None)
    exchange.on_drive_states(state(0))
    exchange.answer()
    assert exchange.guard.arm(exchange.t, TOKEN)
    return exchange


def play(exchange, k, *commands):
    exchange.on_drive_states(state(k))
    for msg in commands:
        exchange.on_command(msg)
    return exchange.answer()


def test_a_command_for_the_newest_state_acts_in_the_next_period():
    exchange = armed()
    exchange.on_drive_states(state(1))
    assert not exchange.is_commanded
    exchange.on_command(command(1))
    assert exchange.is_commanded and exchange.answer_ns == EPOCH_NS + 2 * T_NS
    assert exchange.answer() == [1.0]
    assert exchange.guard.age == pytest.approx(0.005)
    assert not exchange.is_commanded


def test_a_command_for_an_older_state_is_used_but_not_waited_for():
    exchange = armed()
    exchange.on_drive_states(state(2))
    exchange.on_command(command(1))
    assert not exchange.is_commanded
    assert exchange.answer() == [1.0]


def test_a_command_waits_for_the_period_it_is_meant_for_and_is_there_when_that_comes():
    exchange = armed()
    exchange.on_drive_states(state(1))
    exchange.on_command(command(1, (1.0,), delay=2))
    assert exchange.is_heeded and not exchange.is_commanded
    assert exchange.answer() == [0.0]
    exchange.on_drive_states(state(2))
    assert exchange.is_commanded and not exchange.is_heeded
    assert exchange.answer() == [1.0]
    assert exchange.guard.age == pytest.approx(0.01)
    exchange.on_command(command(2, (0.9,), delay=2))
    assert play(exchange, 3, command(3, (0.8,), delay=2)) == [0.9]
    assert exchange.guard.ticks_without_command == 0


def test_what_waits_from_another_session_is_forgotten_with_the_first_command_of_the_next(monkeypatch):
    """Of slow motors: the rest that arming needs is five of their periods, and a command may wait for ten."""
    slow = replace(limits(), period=0.05, max_age=0.15)
    monkeypatch.setattr("flexarm_controller.guard_exchange.guard_limits", lambda *arguments: slow)
    exchange = armed(replace(arm(), rate_hz=20.0))
    play(exchange, 10, command(10, delay=100))
    exchange.guard.stop("button")
    k = 10
    while exchange.guard.mode != STOPPED:
        play(exchange, k := k + 10)
    assert k < 90 and exchange.guard.arm(exchange.t, TOKEN + 1)
    for now in range(k + 10, 100, 10):
        play(exchange, now, command(now, (0.5,), token=TOKEN + 1, sequence=now))
    play(exchange, 100)  # with no other command for the period that the one of before was meant for
    assert exchange.guard.passed > 0
    assert (exchange.guard.refused, exchange.guard.mode) == (0, ARMED)


class Stranger:
    """A command of which token and number may be read, and nothing else: the rest may be large."""

    def __init__(self, token):
        self.session_token, self.sequence = token, 1


@pytest.mark.parametrize("token", [0, TOKEN, TOKEN + 1])
def test_of_a_command_that_is_not_of_the_session_nothing_is_read(token):
    exchange = GuardExchange(arm(), GuardSettings(), None)
    exchange.on_drive_states(state(0))
    exchange.on_command(Stranger(token))
    assert (exchange.guard.refusal, exchange.guard.refused) == ("guard is not armed", 1)
    assert not exchange.is_commanded
    assert exchange.guard.arm(exchange.t, TOKEN)
    if token != TOKEN:
        exchange.on_command(Stranger(token))
        assert exchange.guard.refusal == "command of another session"


def test_forged_and_outdated_commands_neither_act_nor_take_the_place_of_a_real_one():
    exchange = armed()
    play(exchange, 1, command(1, sequence=100))
    forged, outdated = command(2, (9.0,), token=8), command(2, (9.0,), sequence=100)
    real, again = (command(2, (effort,), sequence=101) for effort in (2.0, 9.0))
    assert play(exchange, 2, forged, real, forged, outdated, again) == [2.0]
    assert (exchange.guard.passed, exchange.guard.refused) == (2, 4)
    exchange.on_command(again)
    assert exchange.guard.refusal == "command 101 is not newer than 101"
    assert exchange.guard.mode == ARMED


@pytest.mark.parametrize(
    "names", [(), ("base.ry",), ("base",), ("",), ("base.rz", "base.rz"), ("base.rz", "elbow.rz")]
)
def test_a_command_for_other_axes_neither_acts_nor_takes_the_place_of_a_real_one(names):
    exchange = armed()
    wrong = command(1, (9.0,), names=names, sequence=50)
    assert play(exchange, 1, wrong, command(1, (2.0,)), wrong) == [2.0]
    assert (exchange.guard.passed, exchange.guard.refused) == (1, 2)
    exchange.on_command(wrong)
    assert exchange.guard.refusal == "command is not for the axes base.rz, in this order"


def test_a_command_for_the_axes_in_another_order_is_refused(monkeypatch):
    exchange = armed()
    monkeypatch.setattr(exchange, "names", ("base.rz", "elbow.rz"))
    exchange.on_command(command(0, (1.0, 2.0), names=("elbow.rz", "base.rz")))
    assert exchange.guard.refusal == "command is not for the axes base.rz, elbow.rz, in this order"
    assert not exchange.is_commanded
    exchange.on_command(command(0, (1.0, 2.0), names=("base.rz", "elbow.rz")))
    assert exchange.guard.refused == 1 and exchange.is_commanded


def test_a_new_session_begins_its_own_sequence():
    exchange = armed()
    play(exchange, 1, command(1, sequence=100))
    exchange.guard.stop("button")
    for k in range(2, 60):
        play(exchange, k)
    assert exchange.guard.mode == STOPPED
    exchange.guard.arm(exchange.t, 8)
    play(exchange, 60, command(60, (0.5,), token=8, sequence=1))
    assert exchange.guard.passed == 2


JUMPS = "clock of the drives jumped by"


@pytest.mark.parametrize(
    ("jump", "said"),
    [
        (-10_000, JUMPS),
        (-1, JUMPS),
        (0, "stamp of the drives does not advance"),
        (11, JUMPS),
        (20_000, JUMPS),
    ],
)
def test_a_clock_of_the_drives_that_jumps_or_stands_stops_the_arm(jump, said):
    exchange = armed()
    play(exchange, 1, command(1))
    exchange.on_drive_states(state(1 + jump))
    assert exchange.guard.mode == BRAKING
    assert exchange.guard.reason.startswith(said)
    exchange.on_drive_states(state(2 + jump))
    assert all(map(math.isfinite, exchange.answer()))


@pytest.mark.parametrize(
    ("sec", "nanosec"), [(2**31 - 1, 999_999_999), (2**31 - 1, 2**32 - 1), (-(2**31), 0)]
)
def test_a_stamp_at_the_end_of_time_stops_the_arm_and_has_an_answer(sec, nanosec):
    """None could be written: one message of the drives ended the guard."""
    exchange, msg = armed(), state(1)
    msg.header.stamp.sec, msg.header.stamp.nanosec = sec, nanosec
    exchange.on_drive_states(msg)
    assert exchange.guard.reason.startswith(JUMPS)
    assert all(map(math.isfinite, exchange.answer()))
    assert 0 <= exchange.answer_ns < 2**31 * 10**9


def test_a_state_of_time_zero_is_one():
    """Of lockstep, where time begins there."""
    exchange, msg = GuardExchange(arm(), GuardSettings(), 0), state(0)
    msg.header.stamp = ns_to_stamp(0)
    exchange.on_drive_states(msg)
    assert (exchange.answer_ns, exchange.t) == (T_NS, pytest.approx(0.005))


def test_states_that_were_overwritten_are_counted():
    exchange = armed()
    assert exchange.on_drive_states(state(1)) == 1
    assert exchange.on_drive_states(state(4)) == 3
    assert exchange.guard.mode == ARMED


def test_drives_that_leave_out_an_axis_stop_the_arm():
    exchange = armed()
    play(exchange, 1, command(1))
    exchange.on_drive_states(state(2, names=()))
    exchange.on_command(command(2))
    exchange.answer()
    exchange.look_ahead()
    assert exchange.guard.reason == "drives do not tell position and velocity of every axis"


def test_what_loads_the_arm_where_it_is_now_is_handed_to_the_guard():
    exchange, handed = armed(), []
    exchange.guard.carry = handed.append
    for k, q in enumerate((0.0, 0.5, 0.5), 1):
        exchange.on_drive_states(state(k, q))
        exchange.answer()
        exchange.look_ahead()
    assert [loads.pose for loads in handed] == [(0.5,)]


def test_a_gauge_beyond_its_limit_stops_the_arm():
    exchange = armed()
    gauges = [spec.name for spec in arm().sensors if spec.kind == "strain_gauge"]
    exchange.on_strain(StrainArray(names=gauges, strain=[1.0] * len(gauges)))
    play(exchange, 1, command(1))
    assert "strained beyond its limit" in exchange.guard.reason


def tell_strain(exchange, *shares):
    """Let the gauge speak, once for every share of its limit."""
    (gauge,) = (spec for spec in arm().sensors if spec.kind == "strain_gauge")
    for share in shares:
        exchange.on_strain(StrainArray(names=[gauge.name], strain=[share * gauge.limit]))


@pytest.mark.parametrize(
    "shares", [(1.5, 0.2), (5.0, math.nan), (math.nan, -1.5, 0.2), (math.inf, 0.2), (0.2, 0.3, 1.1, 0.3, 0.2)]
)
def test_a_strain_beyond_the_limit_anywhere_in_a_period_stops_the_arm(shares):
    """Only the last sample of a period was looked at."""
    exchange = armed()
    tell_strain(exchange, *shares)
    play(exchange, 1, command(1))
    assert "strained beyond its limit" in exchange.guard.reason


def test_a_knock_that_is_shorter_than_a_period_stops_the_arm_whenever_it_comes():
    """A half-sine of 3 ms, twice the limit at its peak, a gauge of 1 kHz: 17 of 60 knocks were noticed."""
    for part in range(20):
        exchange, begin, tell = armed(), 1.0 + part / 20, 5
        for k in range(1, 4):
            phases = [(k + j / tell - begin) * T_NS / 3e6 for j in range(tell)]
            tell_strain(exchange, *(2.0 * math.sin(math.pi * x) if 0.0 < x < 1.0 else 0.0 for x in phases))
            play(exchange, k, command(k))
        assert "strained beyond its limit" in exchange.guard.reason


def test_strains_within_the_limit_neither_add_up_nor_last_beyond_their_period():
    exchange = armed()
    seen, step = [], exchange.guard.step
    exchange.guard.step = lambda order, told, t: (seen.append(told.strain), step(order, told, t))[1]
    for k, shares in enumerate([(0.9, 0.9, -0.9), (), (0.1,), (math.nan,)], 1):
        tell_strain(exchange, *shares)
        play(exchange, k, command(k))
    most = exchange.guard.limits.strain[0]
    assert [strain / most for (strain,) in seen] == pytest.approx([0.9, math.nan, 0.1, math.nan], nan_ok=True)
    assert exchange.guard.mode == ARMED


def test_a_gauge_that_has_a_limit_and_was_never_heard_is_told_after_a_second():
    exchange, second = armed(), 10**9 // T_NS
    for k in range(1, second - 1):
        play(exchange, k)
    assert exchange.unheard == ()
    tell_strain(exchange, math.nan)
    play(exchange, second)
    assert exchange.unheard == ("gauge 1 (root_strain)",)
    tell_strain(exchange, 0.1)
    assert exchange.unheard == ()
    for k in range(second + 1, 2 * second):
        play(exchange, k)
    assert exchange.unheard == ()  # one that falls silent later is the estimator's to tell


def test_the_limit_of_a_bridged_gauge_is_one_of_strain():
    (gauge,) = (spec for spec in arm().sensors if spec.kind == "strain_gauge")
    for output, share, is_stopped in ((-0.5, 0.4, False), (-0.5, 0.6, True), (100.0, 90.0, False)):
        config = replace(arm(), sensors=(replace(gauge, output=output),))
        exchange = armed(config)
        exchange.on_strain(StrainArray(names=[gauge.name], strain=[share * gauge.limit]))
        play(exchange, 1, command(1))
        assert ("strained beyond its limit" in exchange.guard.reason) == is_stopped


def test_a_model_is_served_from_its_stamp_on_and_one_of_another_arm_is_refused():
    exchange, others = armed(), PendingModels()
    for k, name in enumerate(("first", "second")):
        msg = ReducedModel(config_id=arm().config_id, model_id=name, theta_names=list(arm().actuated))
        msg.header.stamp = ns_to_stamp(EPOCH_NS + 10 * k * T_NS)
        exchange.on_model(msg)
        others.note(EPOCH_NS + 10 * k * T_NS, name)
    assert exchange.receipt == others.receipt and not exchange.model_fault
    play(exchange, 1, command(1, model_id="first"))
    assert (exchange.guard.model_id, exchange.guard.passed) == ("first", 1)
    play(exchange, 2, command(2, model_id="another"))
    assert exchange.guard.refused == 1
    for k in range(3, 11):
        play(exchange, k, command(k, model_id="first"))
    assert exchange.guard.model_id == "second"
    exchange.on_model(ReducedModel(config_id="x", manipulator="that", model_id="third"))
    assert exchange.model_fault.startswith("model refused: model of 'that' has config x")
    exchange.on_model(ReducedModel(config_id=arm().config_id, model_id="third", theta_names=["x.rz"]))
    assert exchange.model_fault == "model refused: its axes are x.rz, those of the guard base.rz"


def test_commands_before_the_first_state_do_not_matter():
    exchange = GuardExchange(arm(), GuardSettings(), None)
    assert (exchange.stamp_ns, exchange.model_fault) == (-1, "")
    exchange.on_command(command(1))
    assert exchange.answer_ns == 0 and not exchange.is_commanded
    assert exchange.guard.refused == 1
    assert exchange.answer() == [0.0]
    exchange.look_ahead()
