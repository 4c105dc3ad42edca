"""What is learned of the arm changes the law: stiffness told by the estimator, inertia from the torque."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh
from served_arms import limits_of_hub, single_link, state_of, two_axes

from flexarm_controller.firm_mpc import FirmMpc
from flexarm_controller.laws import LawInputs, build_laws
from flexarm_controller.learned.axis_inertia import AxisInertia
from flexarm_controller.learned.learned_model import with_learned
from flexarm_controller.learned.learning import Learning, follow_steps
from flexarm_controller.learning_mpc import KEPT, LearningMpc
from flexarm_controller.mpc import Mpc
from flexarm_controller.reference import Reference, hold
from flexarm_controller.settings import ControllerConfig, MpcConfig

DT, LAG = 0.005, 0.12
LEARNS = MpcConfig(time_limit=0.0, stiffness_step=0.1, inertia_step=0.05, disturbance_lag=LAG)
SENT = np.zeros((1, 1))


def softly_moved(model, stiffness=0.0, t=0.0):
    x = np.concatenate([[0.02, 0.003, 0.0, 0.0], [0.1, 0.05, 0.0, 0.0]])
    told = np.full(2, stiffness) if stiffness else np.zeros(0)
    return replace(state_of(x, model, t), stiffness=told)


def law_that_learns(model, config=LEARNS):
    return LearningMpc(model, limits_of_hub(), config, DT, Learning(1, config, DT))


def test_damping_ratios_of_a_softer_arm_are_those_of_its_damping():
    """D stays: zeta is D / 2 omega, so it grows where omega falls."""
    model = two_axes()
    learned = with_learned(model, np.array([-0.3, 0.2]), np.zeros(2))
    np.testing.assert_allclose(learned.zeta * learned.omega, model.zeta * model.omega, rtol=1e-12)
    assert learned.zeta[0] > model.zeta[0] and learned.zeta[1] < model.zeta[1]


def test_locked_modes_of_the_learned_model_have_the_learned_stiffness():
    model, n = two_axes(), 2
    learned = with_learned(model, np.array([-0.3, 0.2]), np.zeros(2))
    squares = eigh(learned.K[n:, n:], learned.M[n:, n:], eigvals_only=True)
    expected = model.omega**2 * [0.7, 1.2, 1.0]
    np.testing.assert_allclose(squares, expected, rtol=1e-12)
    np.testing.assert_allclose(learned.omega**2, expected, rtol=1e-12)


def test_a_heavier_axis_needs_that_much_more_torque_with_its_modes_locked():
    model = two_axes()
    learned = with_learned(model, np.zeros(0), np.array([0.5, -0.1]))
    more = (learned.M - model.M)[:2, :2]
    np.testing.assert_allclose(more, np.diag([0.5, -0.1] * np.diag(model.M)[:2]), rtol=1e-12)


def test_no_axis_is_believed_to_be_lighter_than_its_modes():
    light = with_learned(single_link("light_hub"), np.zeros(0), np.array([-0.6]))
    assert np.linalg.eigvalsh(light.M).min() > 0.0


def learned_share(share, friction=0.0, load=0.0, noise=0.0, moving=1.0):
    """Return what is learned of an axis of 0.4 kg m^2 in a second of acceleration and one of braking."""
    rng, inertia = np.random.default_rng(1), 0.4
    axes, lagged = AxisInertia(1, LAG, DT), 0.0
    for k in range(600):
        t = k * DT
        a = moving * (1.2 if 1.0 <= t < 2.0 else -3.0 if 2.0 <= t < 2.4 else 0.0)
        v = moving * (1.2 * np.clip(t - 1.0, 0.0, 1.0) - 3.0 * np.clip(t - 2.0, 0.0, 0.4))
        true = -inertia * (load + friction * v + share * a)
        lagged += (1.0 - np.exp(-DT / LAG)) * (true - lagged)
        axes.learn(*map(np.atleast_1d, (v, a, lagged + noise * rng.standard_normal(), inertia)))
    return axes.share[0]


@pytest.mark.parametrize("share", [-0.2, 0.1, 0.5])
def test_inertia_is_found_beside_friction_and_load(share):
    assert learned_share(share) == pytest.approx(share, rel=0.01)
    assert learned_share(share, friction=0.3, load=0.5) == pytest.approx(share, abs=0.03)  # ridge
    assert learned_share(share, noise=0.003) == pytest.approx(share, abs=0.02)  # estimator's own noise


def test_an_axis_that_does_not_move_teaches_nothing():
    assert learned_share(0.3, load=1.0, moving=0.0) == 0.0


def test_steps_have_hysteresis_and_ignore_what_is_not_a_number():
    at = follow_steps((), np.array([0.04, -0.31]), 0.1)
    assert at == (0, -3)
    assert follow_steps(at, np.array([0.07, -0.25]), 0.1) == (0, -3)
    assert follow_steps(at, np.array([0.08, np.nan]), 0.1) == (1, -3)
    assert follow_steps(at, np.array([9.0, -9.0]), 0.1) == (10, -6)


def test_with_nothing_learned_the_plan_is_that_of_the_model():
    model = single_link()
    plans = [Mpc(model, limits_of_hub(), LEARNS, DT), law_that_learns(model)]
    state = softly_moved(model)
    expected, found = (mpc.step(state, hold(np.zeros(1)), SENT).torques for mpc in plans)
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("ahead", [False, True])
def test_the_step_after_stiffness_was_told_uses_the_softer_model(ahead):
    model, reference = single_link(), hold(np.zeros(1))
    learning = law_that_learns(model)
    softer = Mpc(with_learned(model, np.full(2, -0.3), np.zeros(1)), limits_of_hub(), LEARNS, DT)
    learning.step(softly_moved(model, -0.32), reference, SENT)
    if ahead:
        learning.work_ahead()
    state = softly_moved(model, -0.30, DT)
    found, expected = (mpc.step(state, reference, SENT).torques for mpc in (learning, softer))
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_a_heavier_arm_is_braked_with_the_torque_it_needs():
    model, heavier = single_link(), 0.1
    t = np.linspace(0.0, 1.0, 201)
    v = np.minimum(1.2 * t, 0.84)  # accelerates for 0.7 s
    reference = Reference(t, np.cumsum(v)[:, None] * DT, v[:, None], np.gradient(v, t)[:, None])
    learning, plain = law_that_learns(model), Mpc(model, limits_of_hub(), LEARNS, DT)
    lagged = 0.0
    for k in range(130):
        _, theta_dot, theta_ddot = reference.sample(np.array([k * DT]))
        lagged += (1.0 - np.exp(-DT / LAG)) * (-heavier * model.M[0, 0] * theta_ddot[0, 0] - lagged)
        x = np.concatenate([reference.position(k * DT), np.zeros(3), theta_dot[0], np.zeros(3)])
        plans = [mpc.step(state_of(x, model, k * DT, [lagged]), reference, SENT) for mpc in (learning, plain)]
    at = slice(20, 40)  # after 0.7 s, when it goes on at constant velocity: the estimated torque is over then
    braked = np.mean(plans[0].torques[at] - plans[1].torques[at])
    assert braked == pytest.approx(lagged, abs=0.3 * abs(lagged))


@pytest.mark.parametrize("dt", [0.005, 0.002, 0.001])
def test_a_quicker_loop_learns_the_same(dt):
    learning, model, heavier, lagged = Learning(1, LEARNS, dt), single_link(), 0.2, 0.0
    t = np.arange(0.0, 1.0, dt)
    theta_ddot = np.where(t < 0.5, 1.2, -1.2)[:, None]
    theta_dot = np.cumsum(theta_ddot, axis=0) * dt
    reference, J = Reference(t, np.cumsum(theta_dot, axis=0) * dt, theta_dot, theta_ddot), model.M[0, 0]
    for k, now in enumerate(t):
        lagged += (1.0 - np.exp(-dt / LAG)) * (-heavier * J * theta_ddot[k, 0] - lagged)
        state = replace(softly_moved(model, -0.3, now), d=np.array([lagged]))
        learning.learn(state, reference, np.array([J]))
    stiffness, inertia = learning.errors(learning.steps)
    assert inertia[0] == pytest.approx(heavier, abs=0.75 * LEARNS.inertia_step)
    np.testing.assert_allclose(stiffness, -0.3)


def test_the_law_of_another_model_begins_with_what_was_learned_on_the_last():
    model, other, heavier = single_link(), single_link("light_hub"), 0.2
    given = LawInputs(limits_of_hub(), ControllerConfig(), LEARNS)
    t = np.arange(0.0, 1.0, DT)
    theta_ddot = np.where(t < 0.5, 1.2, -1.2)[:, None]
    theta_dot = np.cumsum(theta_ddot, axis=0) * DT
    reference = Reference(t, np.cumsum(theta_dot, axis=0) * DT, theta_dot, theta_ddot)
    law, lagged = build_laws(model, given).planner, 0.0
    for k in range(150):
        lagged += (1.0 - np.exp(-DT / LAG)) * (-heavier * model.M[0, 0] * theta_ddot[k, 0] - lagged)
        state = replace(softly_moved(model, -0.3, t[k]), d=np.array([lagged]))
        law.step(state, reference, SENT)
    law.work_ahead()
    found = with_learned(other, *given.learning.errors(given.learning.steps))
    assert found.M[0, 0] / other.M[0, 0] == pytest.approx(1.0 + heavier, abs=0.05)
    np.testing.assert_allclose((found.omega[:2] / other.omega[:2]) ** 2, 0.7, rtol=1e-9)
    now = softly_moved(other, -0.3, 0.75)
    left = given.learning.not_explained(now.d, given.learning.steps, np.diag(other.M)[:1])
    torques = build_laws(other, given).planner.step(now, reference, SENT).torques
    expected = Mpc(found, limits_of_hub(), LEARNS, DT).step(replace(now, d=left), reference, SENT).torques
    np.testing.assert_allclose(torques, expected, rtol=1e-9, atol=1e-12)


def test_what_the_last_state_before_another_model_teaches_hangs_on_no_spare_time():
    """Nodes have time between two states, one process has not: a 3-TPT's torques were 1.5 % apart."""
    model, other, dt = single_link(), single_link("light_hub"), 0.001
    found = []
    for ahead in (False, True):
        given = LawInputs(limits_of_hub(), ControllerConfig(period=dt), LEARNS)
        for served, begin in ((model, 0), (other, 3)):
            law = build_laws(served, given).planner
            for k in range(begin, begin + 3):  # it learns from every sixth state
                law.step(softly_moved(served, -0.3, k * dt), hold(np.zeros(1)), SENT)
                if ahead:
                    law.work_ahead()
        found.append(given.learning.steps)
    assert found[0] == found[1] == ((-3, -3), ())


def test_programs_do_not_pile_up():
    model = single_link()
    learning = law_that_learns(model, replace(LEARNS, horizon=4, blocks=(1,) * 4))
    for k in range(KEPT + 5):
        share = 0.02 * k - 0.3 if k % 2 else 0.9
        learning.step(softly_moved(model, share, k * DT), hold(np.zeros(1)), SENT)
    assert len(learning._programs) <= KEPT


def test_the_program_not_used_for_longest_gives_way():
    model = single_link()
    learning = law_that_learns(model, replace(LEARNS, horizon=4, blocks=(1,) * 4))

    def learn(step):
        learning.step(softly_moved(model, 0.1 * step), hold(np.zeros(1)), SENT)
        learning.work_ahead()
        return learning._mpc

    first = learn(1)
    for step in range(2, KEPT):
        learn(step)
    assert learn(1) is first  # now the one of step 2 was not used for longest
    for step in (-1, -2):
        learn(step)
    assert learn(1) is first


def taught(model, heavier, law):
    """Let a law follow accelerations of 1.2 rad/s^2 up and, when it stops, still up; return when [s]."""
    t = np.arange(0.0, 1.0, DT)
    theta_ddot = np.where((t // 0.25) % 2 < 1, 1.2, -1.2)[:, None]
    theta_dot = np.cumsum(theta_ddot, axis=0) * DT
    reference, lagged = Reference(t, np.cumsum(theta_dot, axis=0) * DT, theta_dot, theta_ddot), 0.0
    for k in range(141):
        lagged += (1.0 - np.exp(-DT / LAG)) * (-heavier * model.M[0, 0] * theta_ddot[k, 0] - lagged)
        state = replace(softly_moved(model, 0.0, t[k]), d=np.array([lagged]))
        law.step(state, reference, SENT)
        law.work_ahead()
    return float(t[140])


@pytest.mark.parametrize("pause", [2.0, 3600.0, -10.0])
def test_an_arm_that_is_led_again_is_not_taken_for_one_that_accelerates_still(pause):
    """A stop in the middle of an acceleration, then armed at rest: the tip was pushed 4 mm."""
    model = single_link()
    given = LawInputs(limits_of_hub(), ControllerConfig(), LEARNS)
    law = build_laws(model, given).planner
    last = taught(model, 0.3, law)
    learned = given.learning.steps
    assert learned[1]
    resting = state_of(np.zeros(8), model, last + pause, [0.0])
    for k in range(60):
        plan = law.step(replace(resting, t=resting.t + k * DT), hold(np.zeros(1)), SENT)
        law.work_ahead()
        assert abs(plan.torques).max() < (1e-6 if pause > 0.0 else 1e-12)
    assert bool(given.learning.steps[1]) == (pause < 60.0)  # what is long ago is forgotten


def test_a_law_learns_from_motions_that_the_firm_one_leads(monkeypatch):
    """It took the inertia of a firm motion for a load that stays: 3 mrad off after it instead of 1."""
    monkeypatch.setattr(FirmMpc, "_is_firm", lambda *_: True)
    model, found = single_link(), []
    for firm_time in (0.0, 0.6):
        given = LawInputs(limits_of_hub(), ControllerConfig(), replace(LEARNS, firm_time=firm_time))
        law = build_laws(model, given).planner
        taught(model, 0.3, law)
        found.append((given.learning.steps, given.learning._axes._lagged))
    assert isinstance(law, FirmMpc) and found[0][0] == found[1][0] and found[0][0][1]
    np.testing.assert_array_equal(found[0][1], found[1][1])


def test_of_a_model_with_fewer_modes_than_were_learned_those_that_it_has_are_softer():
    """An IndexError left the callback of the model."""
    model = single_link()
    few = replace(
        model, M=model.M[:2, :2], D=model.D[:2, :2], K=model.K[:2, :2], B=model.B[:2], f0=model.f0[:2],
        omega=model.omega[:1], zeta=model.zeta[:1],
    )  # fmt: skip
    found = with_learned(few, np.array([-0.3, -0.2]), np.zeros(0))
    assert found.omega == pytest.approx(few.omega * np.sqrt(0.7))
