"""The guard: nothing unsafe passes, whatever arrives, and a stop stays a stop."""

import ast
import math
from pathlib import Path

import pytest
from guarded_arm import LIMITS, MOVING, REST, STEP, TOKEN, armed, command, stand

import flexarm_controller
from flexarm_controller.guard import ARMED, BRAKING, NOT_ARMED_YET, STOPPED, Guard, GuardState

SOURCE = Path(flexarm_controller.__file__).parent
PURE = [
    "guard.py",
    *(f"guarding/{name}.py" for name in ("axis_label", "checks", "energy", "joint_range", "limits", "loads")),
    *(f"guarding/{name}.py" for name in ("messages", "plausibility", "rest_watch", "stop_brake")),
    *(f"guarding/{name}.py" for name in ("arm_brake", "obedience", "onward")),
]


def test_a_new_guard_is_stopped_whatever_was_before():
    guard = Guard(LIMITS)
    assert (guard.mode, guard.reason, guard.refusal) == (STOPPED, NOT_ARMED_YET, "")
    assert (guard.token, guard.model_id, guard.age, guard.energy) == (0, "", -1.0, 0.0)
    assert (guard.passed, guard.limited, guard.refused) == (0, 0, 0)
    assert (guard.ticks, guard.ticks_without_command) == (0, 0)
    assert guard.step(None, REST, 0.0) == [0.0, 0.0]
    assert guard.mode == STOPPED and guard.reason == NOT_ARMED_YET == "not armed yet"


def test_a_fresh_command_of_the_session_passes_unchanged():
    guard = armed()
    assert guard.step(command(0.0), REST, 0.005) == [0.3, 0.1]
    assert (guard.mode, guard.reason, guard.passed, guard.limited, guard.refused) == (ARMED, "", 1, 0, 0)
    assert guard.age == pytest.approx(0.005) and guard.ticks == 1 and guard.refusal == ""


def test_the_age_is_that_of_the_command_in_use():
    guard = armed(1.0)
    guard.step(command(1.0), REST, 1.005)
    assert guard.age == pytest.approx(0.005)
    guard.step(None, REST, 1.01)
    assert guard.age == pytest.approx(0.01)


def test_torque_and_its_rate_are_cut_and_counted():
    guard = armed()
    first = guard.step(command(0.0, 1, (9.0, -9.0)), REST, 0.0)
    assert first == [STEP[0], -STEP[1]]
    for k in range(1, 10):
        last = guard.step(command(k * 0.005, k + 1, (9.0, -9.0)), REST, k * 0.005)
    assert last == [2.0, -5.0]
    assert guard.limited == guard.passed == guard.ticks == 10


def test_a_torque_just_inside_its_limits_is_not_counted_as_cut():
    guard = armed()
    guard.step(command(0.0, 1, STEP), REST, 0.0)
    guard.step(command(0.005, 2, (0.0, -0.0)), REST, 0.005)
    assert (guard.passed, guard.limited) == (2, 0)


def test_a_torque_of_the_brake_that_is_cut_is_no_command_that_was():
    guard = armed()
    guard.step(command(0.0), MOVING, 0.0)
    guard.stop("test")
    assert guard.step(None, MOVING, 0.005)[0] == pytest.approx(0.3 - STEP[0])
    assert (guard.passed, guard.limited) == (1, 0)


def test_what_is_returned_is_not_what_is_remembered():
    guard = armed()
    guard.step(command(0.0), REST, 0.0).clear()
    assert guard.step(None, REST, 0.005) == [0.3, 0.1]


def test_before_arming_every_command_is_refused():
    guard = Guard(LIMITS)
    assert guard.step(command(0.0), REST, 0.0) == [0.0, 0.0]
    assert (guard.mode, guard.refused, guard.token, guard.age) == (STOPPED, 1, 0, -1.0)
    assert guard.refusal == "guard is not armed" and guard.ticks_without_command == 0


@pytest.mark.parametrize(
    ("bad", "why"),
    [
        ((math.nan, 0.0), "command is not finite"),
        ((0.0, math.inf), "command is not finite"),
        ((0.0,), "command has 1 efforts, the arm has 2 axes"),
        ((), "command has 0 efforts, the arm has 2 axes"),
        ((0.0, 0.0, 0.0), "command has 3 efforts, the arm has 2 axes"),
    ],
)
def test_a_command_that_cannot_be_meant_latches_a_stop_at_once(bad, why):
    guard = armed()
    guard.step(command(0.0), MOVING, 0.0)
    torque = guard.step(command(0.005, 2, bad), MOVING, 0.005)
    assert (guard.mode, guard.reason, guard.token, guard.age) == (BRAKING, why, 0, -1.0)
    assert torque[0] < 0.3 and torque[1] > 0.1  # against the motion
    assert (guard.passed, guard.refused) == (1, 1)
    guard.step(command(0.01, 3), MOVING, 0.01)
    assert guard.mode == BRAKING and guard.refused == 2


def test_a_command_of_another_session_is_refused_but_does_not_stop_the_arm():
    guard = armed()
    guard.step(command(0.0), MOVING, 0.0)
    assert guard.step(command(0.005, 2, (math.nan, 0.0), token=8), MOVING, 0.005) == [0.3, 0.1]
    assert (guard.mode, guard.refused, guard.ticks_without_command) == (ARMED, 1, 1)
    assert guard.refusal == "command of another session"


OLD_REPEATED_OR_FUTURE = {
    (0.1, 1): "command 1 is not newer than 1",
    (0.1, 0): "command 0 is not newer than 1",
    (0.05, 2): "command 2 is not newer than 1",
    (0.04, 2): "command 2 is not newer than 1",
    (math.nan, 2): "command 2 is not newer than 1",
    (0.12, 2): "command is -20 ms old",
    (0.106, 2): "command is -6 ms old",
}


@pytest.mark.parametrize(("stamp", "sequence"), OLD_REPEATED_OR_FUTURE)
def test_an_old_repeated_or_future_command_is_not_used(stamp, sequence):
    guard = armed()
    guard.step(command(0.05, 1), MOVING, 0.095)
    assert guard.step(command(stamp, sequence), MOVING, 0.1) == [0.3, 0.1]
    assert (guard.passed, guard.refused) == (1, 1)
    assert guard.refusal == OLD_REPEATED_OR_FUTURE[stamp, sequence]


@pytest.mark.parametrize(
    ("stamp", "passes"), [(-0.0504, True), (-0.0506, False), (0.004, True), (0.005, False)]
)
def test_a_command_may_be_50_ms_and_a_tenth_of_a_period_old_and_less_than_a_period_ahead(stamp, passes):
    guard = armed(-1.0)
    guard.step(command(stamp), REST, 0.0)
    assert (guard.passed, guard.refused, guard.mode) == (passes, not passes, ARMED)


def test_the_first_command_may_have_any_sequence_from_zero_and_a_refusal_is_forgotten_with_the_next():
    guard = armed()
    guard.step(command(0.0, -1), REST, 0.0)
    assert guard.refusal == "command -1 is not newer than -1"
    guard.step(command(0.0, 0), REST, 0.0)
    assert guard.passed == 1 and guard.refusal == ""


def test_silence_of_50_ms_brakes_and_rest_stops():
    guard = armed()
    guard.step(command(0.0), MOVING, 0.0)
    modes = []
    for k in range(1, 15):
        guard.step(None, MOVING, k * 0.005)
        modes.append(guard.mode)
    assert modes == [ARMED] * 10 + [BRAKING] * 4
    assert guard.reason == "no command for 50 ms"
    assert guard.ticks_without_command == 11
    assert not guard.arm(0.1, 8)
    guard.step(None, REST, 0.1)
    assert guard.mode == BRAKING
    t = stand(guard, 0.105)
    assert guard.mode == STOPPED and guard.reason == "no command for 50 ms"
    guard.step(command(t, 99, token=8), REST, t)
    assert guard.refusal
    assert guard.arm(t, 8) and (guard.token, guard.reason, guard.refusal) == (8, "", "")
    guard.step(command(t, 0, token=8), REST, t)  # a new session counts and dates anew
    assert guard.passed == 2


@pytest.mark.parametrize(("refused", "rest"), [(False, ""), (True, "; refused: command of another session")])
def test_a_session_in_which_nobody_ever_commands_is_not_called_a_late_command(refused, rest):
    """It said "no command for 50 ms" after two seconds of none: people looked at the load of the machine."""
    guard, k = armed(), 0
    while guard.mode == ARMED:
        k += 1
        guard.step(command(k * 0.005, token=99) if refused else None, REST, k * 0.005)
    assert guard.reason == f"no command within {guard.limits.arming_time:g} s of arming{rest}"
    assert k * 0.005 == pytest.approx(guard.limits.arming_time, abs=0.011)


def test_a_stop_by_silence_names_what_was_refused_last():
    guard = armed()
    guard.step(command(0.0), MOVING, 0.0)
    for k in range(1, 12):
        guard.step(command(k * 0.005, 0), MOVING, k * 0.005)
    assert guard.reason == "no command for 50 ms; refused: command 0 is not newer than 1"


def test_the_torque_of_a_silent_controller_is_kept_for_a_period_and_then_fades_to_nothing():
    guard = armed()
    guard.step(command(0.0), MOVING, 0.0)
    torques = [guard.step(None, MOVING, k * 0.005)[0] for k in range(1, 11)]
    assert torques == pytest.approx([0.3, *(0.3 * k / 9 for k in range(8, -1, -1))], abs=1e-12)
    assert guard.mode == ARMED
    assert guard.step(command(0.05, 2), MOVING, 0.05) == [0.3, 0.1]
    assert guard.step(None, MOVING, 0.055) == [0.3, 0.1]  # bridged again


def test_a_clock_that_is_not_a_number_counts_as_silence():
    guard = armed()
    guard.step(None, MOVING, math.nan)
    assert guard.mode == BRAKING


def test_the_first_command_has_the_arming_time():
    guard = armed(1.0)
    guard.step(None, MOVING, 1.0 + LIMITS.arming_time)
    assert guard.mode == ARMED and guard.ticks_without_command == 0 and guard.age == -1.0
    guard.step(None, MOVING, 1.0 + LIMITS.arming_time + LIMITS.period)
    assert guard.mode == BRAKING and guard.ticks_without_command == 0


def test_arming_again_keeps_the_session_and_token_zero_is_none():
    guard = armed()
    assert guard.arm(1.0, 9) is True and guard.token == TOKEN
    assert guard.arm(1.0, 0) is True
    assert Guard(LIMITS).arm(0.0, 0) is False


def test_a_stop_keeps_its_first_reason_and_needs_an_armed_guard():
    guard = armed()
    guard.stop("button")
    guard.stop("another")
    assert (guard.mode, guard.reason, guard.token) == (BRAKING, "button", 0)
    stopped = Guard(LIMITS)
    stopped.stop("button")
    assert (stopped.mode, stopped.reason) == (STOPPED, NOT_ARMED_YET)


def test_rest_is_up_to_the_rest_velocity_of_every_axis():
    for velocity, mode in (((0.01, -0.01), STOPPED), ((0.0, 0.0101), BRAKING), ((-0.0101, 0.0), BRAKING)):
        guard = armed()
        guard.stop("test")
        stand(guard, 0.0, GuardState(velocity, (0.0, 0.0)))
        assert guard.mode == mode


@pytest.mark.parametrize(
    "velocity", [(math.nan, math.nan), (math.inf, 0.0), (), (1.0, 2.0, 3.0), (1e308, 0.0)]
)
def test_a_velocity_that_cannot_be_true_is_not_rest_and_leaves_the_torque_finite(velocity):
    guard = armed()
    guard.step(command(0.0), REST, 0.0)
    guard.stop("test")
    for position in ((), (0.0, 0.0), (math.nan, 0.0), (1e308, -1e308)):
        torque = guard.step(None, GuardState(velocity, position), 0.005)
        assert all(math.isfinite(value) for value in torque)
    assert guard.mode == BRAKING
    if not any(math.isfinite(v) for v in velocity) or len(velocity) != 2:
        assert torque == [0.0, 0.0]


@pytest.mark.parametrize("name", PURE)
def test_the_guard_imports_nothing_but_the_standard_library_and_its_own_parts(name):
    tree = ast.parse((SOURCE / name).read_text())
    imported = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
    imported |= {name.name for node in ast.walk(tree) if isinstance(node, ast.Import) for name in node.names}
    parts = [part[:-3].replace("/", ".") for part in (*PURE, "guarding.py")]
    own = {f"flexarm_controller.{part}" for part in parts}
    assert imported <= {"__future__", "math", "collections", "collections.abc", "dataclasses", "typing"} | own
