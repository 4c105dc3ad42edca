"""The ladder as a table: every rung by its condition, every step within the rate limit, down and up."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from served_arms import limits_of_hub, single_link, state_of, two_axes, two_axis_limits

from flexarm_controller.controller import Controller
from flexarm_controller.ladder import DAMPING, HOLD, LAW, LQR, RUNGS, SHIFTED_PLAN, Cycle, FormerPlan, choose
from flexarm_controller.laws import LAWS, build_laws
from flexarm_controller.mpc import Plan
from flexarm_controller.reference import hold
from flexarm_controller.settings import ControllerConfig, MpcConfig
from flexarm_controller.solvers.qp import QpResult
from flexarm_controller.time_budget import NO_PLAN, Clocks, TimeBudget
from flexarm_controller.trust import Trust, deviation_scale
from flexarm_model.settings.parameters import ParameterError

DT = 0.005
MODEL = single_link()
LIMITS = limits_of_hub(effort=2.0, effort_rate=40.0)
MOVING = np.array([0.1, 1e-4, 0, 0, 1.0, 0, 0, 0])
STILL = np.zeros(8)
DOCS = Path(__file__).parents[3] / "docs" / "ladder.md"


class Told:
    """A law that does what it is told to: a torque, nothing, nonsense, or an error."""

    def __init__(self):
        self.answer = 0.0

    def step(self, state, reference, sent):
        if isinstance(self.answer, Exception):
            raise self.answer
        if self.answer is None:
            return Plan(np.zeros((0, 1)), QpResult(np.zeros(0), "infeasible", 3, np.inf, False), ())
        return Plan(np.full((8, 1), self.answer), QpResult(np.zeros(8), "solved", 1, 0.0, True), ())

    def work_ahead(self):
        pass


def told(**settings):
    controller = Controller(MODEL, LIMITS, ControllerConfig(**settings), MpcConfig(time_limit=0.0))
    law = Told()
    controller.adopt(replace(controller._laws, planner=law))
    return controller, law


@pytest.mark.parametrize(
    ("answer", "reason"),
    [
        (None, "solver: infeasible"),
        (np.nan, "law: torque is not finite"),
        (RuntimeError("lost\n the plot"), "law raised RuntimeError: lost the plot"),
        (MemoryError(), "law raised MemoryError: "),
    ],
)
def test_a_law_that_fails_is_replaced_in_the_same_cycle_and_asked_again_in_the_next(answer, reason):
    controller, law = told()
    assert controller.step(state_of(MOVING, MODEL)).mode == "mpc"
    law.answer = answer
    fallback = controller.step(state_of(MOVING, MODEL, DT))
    assert (fallback.mode, fallback.reason) == ("shifted_plan", reason)
    law.answer = 0.1
    again = controller.step(state_of(MOVING, MODEL, 2 * DT))
    assert (again.mode, again.reason) == ("mpc", "")


def cycle(**changes):
    laws = build_laws(MODEL, Controller(MODEL, LIMITS)._inputs)
    usual = Cycle(
        state_of(MOVING, MODEL), hold(np.zeros(1)), np.zeros((1, 1)), laws, "", "mpc",
        Plan(np.ones((3, 1)), NO_PLAN.result, ()), "", np.full((2, 1), 0.5), 0.01, False,
    )  # fmt: skip
    return usual._replace(**changes)


NO_FORMER = {"refusal": "solver: x", "former": np.zeros((0, 1))}
CYCLES = [
    ({}, LAW, "mpc", ""),
    ({"refusal": "solver: x"}, SHIFTED_PLAN, "shifted_plan", "solver: x"),
    (NO_FORMER, LQR, "lqr", "solver: x; no earlier plan reaches here"),
    ({"fault": "state is not finite"}, DAMPING, "damping", "state is not finite"),
    ({"fault": "lost", "state": state_of(STILL, MODEL)}, HOLD, "hold", "lost"),
]


@pytest.mark.parametrize(("changes", "rung", "mode", "reason"), CYCLES, ids=[c[2] for c in CYCLES])
def test_each_rung_speaks_under_its_condition_and_says_why_none_above_does(changes, rung, mode, reason):
    choice = choose(cycle(**changes))
    assert (choice.rung, choice.mode, choice.reason) == (rung, mode, reason)
    assert np.isfinite(choice.torque).all()


def heavy_cycle(**changes):
    """An arm whose motors bear weight, with a state that cannot be used."""
    laws = build_laws(two_axes(), Controller(two_axes(), two_axis_limits())._inputs)
    return cycle(fault="lost", laws=laws, state=state_of(np.zeros(10), two_axes()), **changes)


def test_an_arm_with_weight_is_left_to_the_guard_once_nothing_leads_it():
    """Under damping it fell by 1.6 rad with 80 g instead of 54 g, and the guard stayed armed."""
    assert choose(heavy_cycle()).mode == "hold"
    left = choose(heavy_cycle(is_lost=True))
    assert (left.mode, left.reason) == ("inactive", "lost")
    assert choose(cycle(fault="lost", state=state_of(STILL, MODEL), is_lost=True)).mode == "hold"


def test_what_is_left_to_the_guard_is_no_command():
    arm = Controller(two_axes(), two_axis_limits())
    rest = replace(state_of(np.zeros(10), two_axes()), usable=False, reason="lost")
    modes = [arm.step(replace(rest, t=k * DT)).mode for k in range(22)]
    assert modes == ["hold"] * 20 + ["inactive"] * 2
    assert arm.step(replace(rest, t=22 * DT)).for_guard(1, 1) is None
    assert arm.step(state_of(np.zeros(10), two_axes(), 23 * DT)).for_guard(2, 1) is not None


@pytest.mark.parametrize("lqr", [None, "nan"])
def test_without_a_finite_answer_of_lqr_the_joints_are_damped(lqr):
    class Nonsense:
        def step(self, state, reference, sent):
            return np.array([np.nan])

    usual = cycle(**NO_FORMER)
    choice = choose(usual._replace(laws=replace(usual.laws, lqr=Nonsense() if lqr else None)))
    assert choice.mode == "damping" and choice.reason.endswith("; no torque from LQR")


def test_docs_have_every_rung_with_its_condition():
    text = DOCS.read_text(encoding="utf-8")
    for rung in RUNGS:
        assert f"| `{rung.mode or 'law'}` | {rung.speaks_when} |" in text


def test_every_law_that_can_be_asked_for_is_in_the_table():
    for law in LAWS:
        ControllerConfig(law=law)
    with pytest.raises(ParameterError) as refused:
        ControllerConfig(law="pid")
    assert all(law in str(refused.value) for law in LAWS)


def test_an_earlier_plan_is_followed_by_time_and_for_so_many_periods():
    plan = FormerPlan(1, DT, 3)
    assert not len(plan.ahead(0.0))
    plan.keep(1.0, np.arange(10.0)[:, None])
    assert [plan.ahead(1.0 + k * DT)[0, 0] for k in (1, 2, 3)] == [1.0, 2.0, 3.0]
    assert not any(len(plan.ahead(t)) for t in (1.0, 0.9, 1.0 + 4 * DT, np.nan))
    plan.drop()
    assert not len(plan.ahead(1.0 + DT))


FAULTS = st.sampled_from(["good", "fails", "raises", "nan", "lost", "state", "reference", "reset", "gap"])


@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.lists(st.tuples(FAULTS, st.floats(-50.0, 50.0), st.floats(-3.0, 3.0)), min_size=2, max_size=25))
def test_no_transition_jumps_by_more_than_the_rate_limit(events):
    """Down and up again, whichever rung speaks; a new session begins at zero torque."""
    controller, law = told()
    last, t, modes = 0.0, 0.0, set()
    for fault, torque, velocity in events:
        t += 7 * DT if fault == "gap" else DT
        law.answer = {"fails": None, "raises": ValueError("x"), "nan": np.nan}.get(fault, torque)
        x = MOVING * [1, 1, 1, 1, velocity, 1, 1, 1]
        state = state_of(x, MODEL, t, [np.nan] if fault == "state" else None)
        if fault == "reset":
            controller.reset()
            last = 0.0
        if fault == "reference":
            controller.follow(hold(np.array([torque / 50.0])))
        command = controller.step(replace(state, usable=fault != "lost"))
        assert abs(command.tau[0] - last) <= 40.0 * DT * (1 + 1e-12) and abs(command.tau[0]) <= 2.0
        assert bool(command.reason) == (command.mode != "mpc")
        last = command.tau[0]
        modes.add(command.mode)


def clocks(*steps):
    """Return clocks whose wall time passes by ``steps`` between looks."""
    readings = iter(np.repeat(np.cumsum([0.0, *steps]), 2)[1:])
    return Clocks(cpu=lambda: 0.0, wall=lambda: float(next(readings)))


def test_a_law_that_overruns_its_budget_rests_until_it_is_paid_back():
    controller = Controller(
        MODEL, LIMITS, ControllerConfig(time_budget=0.8), clocks=clocks(0.003, 0.009, 0.001)
    )
    modes = [controller.step(state_of(MOVING, MODEL, k * DT)).mode for k in range(5)]
    assert modes == ["mpc", "mpc", "shifted_plan", "shifted_plan", "mpc"]  # 9 ms of 4 ms: back after three
    assert controller.overruns == 1


def test_the_reason_of_a_resting_law_names_both_times():
    budget = TimeBudget(0.004, DT, clocks(0.0123).wall)
    plan = Plan(np.ones((1, 1)), QpResult(np.ones(1), "solved", 0, 0.0, True), ())
    assert budget.ask(0.0, lambda: plan)[1] == ""
    assert budget.ask(DT, lambda: plan)[1] == "the law rests: it took 12.3 ms of 4 ms"


def test_a_resting_law_is_asked_again_when_stamps_go_back():
    budget = TimeBudget(0.004, DT, clocks(0.0123, 0.001).wall)
    plan = Plan(np.ones((1, 1)), QpResult(np.ones(1), "solved", 0, 0.0, True), ())
    assert [budget.ask(t, lambda: plan)[1] for t in (100.0, 50.0)] == ["", ""]


@pytest.mark.parametrize("share", [0.0, 0.8])
def test_without_a_wall_clock_or_a_budget_nothing_rests(share):
    wall = None if share else clocks(*np.ones(20)).wall
    settings, patient = ControllerConfig(time_budget=share), MpcConfig(time_limit=0.0)
    controller = Controller(MODEL, LIMITS, settings, patient, clocks=Clocks(wall=wall))
    assert all(controller.step(state_of(MOVING, MODEL, k * DT)).mode == "mpc" for k in range(4))
    assert controller.overruns == 0


def test_the_law_takes_over_once_the_state_is_sure_and_stays_until_an_interruption():
    controller, _ = told(start_sigma=20.0)
    scale = deviation_scale(MODEL, MpcConfig(), DT)
    sure, unsure = (replace(state_of(STILL, MODEL), sigma=s / (3 * scale)) for s in (19.9, 20.1))
    first = controller.step(unsure)
    assert first.mode == "hold" and "3 sigma of the state is 20.1 of at most 20" in first.reason
    told_modes = [
        controller.step(replace(state, t=k * DT, usable=usable)).mode
        for k, (state, usable) in enumerate(
            [(sure, True), (unsure, True), (sure, False), (unsure, True), (sure, True)], start=1
        )
    ]
    assert told_modes == ["mpc", "mpc", "hold", "hold", "mpc"]


def test_a_sigma_that_is_not_a_number_is_not_sure():
    trust = Trust(20.0)
    assert trust.fault(np.array([np.nan, 0.0]), np.ones(2)) and trust.fault(np.array([np.inf]), np.ones(1))
    assert not trust.fault(np.zeros(0), np.ones(2))


def test_one_deviation_of_the_settings_costs_one():
    scale = deviation_scale(MODEL, MpcConfig(position_error=0.02, velocity_error=0.5), DT)
    assert scale[0] == pytest.approx(50.0) and scale[4] == pytest.approx(2.0)


def test_missed_periods_keep_the_last_torque_on_its_way():
    controller, law = told()
    controller = Controller(MODEL, LIMITS, mpc=MpcConfig(delay_periods=3, time_limit=0.0))
    for k in range(3):
        controller.step(state_of(MOVING, MODEL, k * DT))
    last = controller._sent[-1].copy()
    controller._note_missed(4 * DT)
    np.testing.assert_array_equal(controller._sent[-2:], [last, last])
