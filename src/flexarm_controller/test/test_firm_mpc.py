"""Motions that bring the modes to rest by themselves are followed exactly, others softly."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from served_arms import limits_of_hub, single_link, state_of

from flexarm_controller.firm_mpc import FirmMpc
from flexarm_controller.mpc import Mpc
from flexarm_controller.open_loop.rest_to_rest import RestToRest
from flexarm_controller.program.cost import build_cost
from flexarm_controller.program.firm_motions import _ringing, firm, firm_motions
from flexarm_controller.reference import Reference
from flexarm_controller.settings import MpcConfig
from flexarm_model.settings.parameters import ParameterError

DT, START, REST = 0.005, 0.5, 1.0
CONFIG = MpcConfig(time_limit=0.0, firm_time=0.4)


def of_velocity(velocity, start=START):
    """Return the reference of velocities every period [rad/s], (k,), with rest before and after."""
    before, after = np.zeros(round(start / DT)), np.zeros(round(REST / DT))
    v = np.concatenate([before, velocity, after])
    t = DT * np.arange(v.size)
    theta = np.concatenate([[0.0], np.cumsum((v[1:] + v[:-1]) / 2 * DT)])
    return Reference(t, theta[:, None], v[:, None], np.gradient(v, DT)[:, None])


@pytest.fixture(scope="module")
def time_optimal():
    """Velocities of the fastest way of 10 degrees that leaves no mode ringing."""
    model = single_link()
    problem = RestToRest(model, limits_of_hub(), np.zeros(1), np.array([np.radians(10.0)]), DT)
    plan = problem.solve(40)
    return plan.x[:, model.n]


def ramps(periods=40):
    return 1.7 * np.minimum(np.linspace(0.0, 2.0, periods), np.linspace(2.0, 0.0, periods))


def test_ringing_is_what_integrating_every_mode_leaves(time_optimal):
    model = single_link()
    for velocity in (ramps(), time_optimal):
        largest = left = 0.0
        x = np.zeros(2 * model.n_eta)
        for change in np.diff(velocity):

            def equation(_, x, push=model.M[0, 1:] * change / DT):
                eta, eta_dot = np.split(x, 2)
                return np.append(
                    eta_dot, -push - 2 * model.zeta * model.omega * eta_dot - model.omega**2 * eta
                )

            x = solve_ivp(equation, (0.0, DT), x, rtol=1e-9, atol=1e-12).y[:, -1]
            left = np.sqrt(
                x[model.n_eta :] @ x[model.n_eta :]
                + (model.omega * x[: model.n_eta]) @ (model.omega * x[: model.n_eta])
            )
            largest = max(largest, left)
        assert _ringing(model, velocity[:, None], DT) == pytest.approx(left / largest, abs=0.01)


def test_a_mode_that_creeps_back_is_as_slow_as_its_slower_pole():
    model = single_link()
    zeta, kick = np.array([4.0, 3.0, 2.0]), np.append(0.0, np.full(20, 1.0))
    slowest = model.omega * (zeta - np.sqrt(zeta**2 - 1.0))
    share = model.M[0, 1:] * np.exp(-slowest * 19 * DT)
    expected = np.linalg.norm(share) / np.linalg.norm(model.M[0, 1:])
    assert _ringing(replace(model, zeta=zeta), kick[:, None], DT) == pytest.approx(expected, rel=1e-9)


def test_only_a_short_motion_that_leaves_no_mode_ringing_is_followed_exactly(time_optimal):
    model, reference = single_link(), of_velocity(time_optimal)
    duration = DT * (time_optimal.size - 1)
    np.testing.assert_allclose(
        firm_motions(reference, model, 0.4, DT), [[START, START + duration]], atol=2 * DT
    )
    assert firm_motions(reference, model, duration / 2, DT).size == 0
    assert firm_motions(of_velocity(ramps()), model, 0.4, DT).size == 0
    assert firm_motions(reference, single_link(frequency_scale=0.9), 0.4, DT).size == 0


def test_several_motions_are_judged_each_for_itself(time_optimal):
    both = np.concatenate([time_optimal, np.zeros(100), ramps(), np.zeros(100), time_optimal])
    assert firm_motions(of_velocity(both), single_link(), 0.4, DT).shape == (2, 2)


def test_the_law_is_firm_from_when_the_motion_comes_into_sight_until_its_end(time_optimal):
    model, limits = single_link(), limits_of_hub()
    soft, firmly = Mpc(model, limits, CONFIG, DT), Mpc(model, limits, firm(CONFIG), DT)
    law = FirmMpc(Mpc(model, limits, CONFIG, DT), model, limits, CONFIG, DT)
    reference, sent, x = of_velocity(time_optimal), np.zeros((1, 1)), np.full(8, 1e-3)
    end, ahead = START + DT * time_optimal.size, CONFIG.horizon * DT
    for t, other in (
        (START - ahead - 0.02, soft),
        (START - ahead + 0.02, firmly),
        (end - 0.02, firmly),
        (end + 0.02, soft),
    ):
        state = state_of(x, model, t)
        found, expected = (one.step(state, reference, sent).torques[0] for one in (law, other))
        np.testing.assert_allclose(found, expected, rtol=1e-6)


def firm_at(law, reference, until):
    """Return the times at which a law is firm, period by period."""
    return [t for t in DT * np.arange(round(until / DT)) if law._is_firm(t, reference)]


def test_the_law_is_firm_no_longer_than_it_says_however_motions_follow_each_other(time_optimal):
    model, limits = single_link(), limits_of_hub()
    law = FirmMpc(Mpc(model, limits, CONFIG, DT), model, limits, CONFIG, DT)
    assert law.lasts == pytest.approx(CONFIG.firm_time + CONFIG.horizon * DT)
    rest = np.zeros(20)
    many = of_velocity(np.concatenate([np.concatenate([time_optimal, rest])] * 10))
    assert len(firm_motions(many, model, CONFIG.firm_time, DT)) == 10
    first = firm_at(law, many, many.t[-1])
    assert first[-1] - first[0] < law.lasts and len(first) > 0.9 * law.lasts / DT
    again = of_velocity(np.concatenate([time_optimal, np.zeros(100), time_optimal]))
    second = firm_at(FirmMpc(law, model, limits, CONFIG, DT), again, again.t[-1])
    assert len(second) == pytest.approx(2 * (time_optimal.size + CONFIG.horizon), abs=6)  # both, whole


def test_the_law_is_firm_no_longer_than_it_says_though_stamps_have_gone_back(time_optimal):
    """A row of motions was followed firmly to its end, for 5 s, after a clock that was set back."""
    model, limits = single_link(), limits_of_hub()
    law = FirmMpc(Mpc(model, limits, CONFIG, DT), model, limits, CONFIG, DT)
    many = of_velocity(np.concatenate([np.concatenate([time_optimal, np.zeros(20)])] * 10))
    late = replace(many, t=many.t + 100.0)
    firm_late = [t for t in late.t if law._is_firm(t, late)]
    again = firm_at(law, many, many.t[-1])
    assert firm_late and again == firm_at(FirmMpc(law, model, limits, CONFIG, DT), many, many.t[-1])


def test_a_law_made_on_the_way_counts_from_when_the_motion_came_into_sight(time_optimal):
    model, limits = single_link(), limits_of_hub()
    law = FirmMpc(Mpc(model, limits, CONFIG, DT), model, limits, CONFIG, DT)
    assert law._is_firm(START + 0.05, of_velocity(time_optimal))
    assert law._since == pytest.approx(START - CONFIG.horizon * DT, abs=2 * DT)


@pytest.mark.parametrize("every", [0.1, 0.3])  # s
def test_the_law_is_firm_no_longer_than_it_says_though_models_change_on_the_way(time_optimal, every):
    model, limits = single_link(), limits_of_hub()
    motion = np.concatenate([time_optimal, np.zeros(20)])
    many = of_velocity(np.concatenate([np.tile(motion, 8), np.zeros(100), motion]))
    soft, periods, law = Mpc(model, limits, CONFIG, DT), round(every / DT), None
    is_firm = []
    for k, t in enumerate(DT * np.arange(round(many.t[-1] / DT))):
        if law is None or k % periods == 0:
            law = FirmMpc(soft, model, limits, CONFIG, DT)
        is_firm.append(law._is_firm(t, many))
    runs = [len(run) * DT for run in "".join("x" if one else " " for one in is_firm).split()]
    assert len(runs) == 2  # the first motions, as long as it may, and the one after the pause, whole
    assert runs[0] == pytest.approx(law.lasts, abs=2 * DT) and runs[0] <= law.lasts + 1e-9
    assert runs[1] == pytest.approx(DT * (time_optimal.size + CONFIG.horizon), abs=3 * DT)


def test_firm_axes_cost_the_square_of_the_firmness_and_modes_and_torque_that_much_less():
    model, f = single_link(), CONFIG.firmness
    soft, stiff = (build_cost(model, config, DT) for config in (CONFIG, firm(CONFIG)))
    axes = [0, model.n]
    modes = np.delete(np.arange(2 * model.n), axes)
    share = np.diag(stiff.Q) / np.diag(soft.Q)
    np.testing.assert_allclose(share[axes], f**2)
    np.testing.assert_allclose(share[modes], 1 / f)
    np.testing.assert_allclose([stiff.R / soft.R, stiff.S / soft.S], f**-4.0)  # deviations f^2 as large


def test_firm_weights_are_the_soft_ones_for_firmness_one():
    assert firm(replace(CONFIG, firmness=1.0)) == replace(CONFIG, firmness=1.0)
    assert firm(CONFIG).position_error == CONFIG.position_error / CONFIG.firmness


def test_a_reference_of_an_hour_is_looked_at_a_second_at_a_time(time_optimal, monkeypatch):
    """All of it was sampled by the control period, in the period after it had come: half a second."""
    model, limits = single_link(), limits_of_hub()
    motion, hour = of_velocity(time_optimal), 3600.0
    t = np.concatenate([motion.t, motion.t[1:] + hour])
    twice = [np.concatenate([x, x[1:] + x[-1] * is_place]) for x, is_place in (
        (motion.theta, True), (motion.theta_dot, False), (motion.theta_ddot, False))]  # fmt: skip
    long, sampled = Reference(t, *twice), []
    sample = Reference.sample
    monkeypatch.setattr(Reference, "sample", lambda self, at: sampled.append(at.size) or sample(self, at))
    law = FirmMpc(Mpc(model, limits, CONFIG, DT), model, limits, CONFIG, DT)
    end = START + DT * time_optimal.size
    for begin in (0.0, hour):
        assert not law._is_firm(begin + START - CONFIG.horizon * DT - 0.02, long)
        assert law._is_firm(begin + START - CONFIG.horizon * DT + 0.02, long)
        assert law._is_firm(begin + end - 0.02, long)
        assert not law._is_firm(begin + end + 0.02, long)
    assert max(sampled) < 1000


def test_motions_within_a_window_are_those_of_the_whole_that_lie_in_it(time_optimal):
    model = single_link()
    rest = np.zeros(20)
    many = of_velocity(np.concatenate([np.concatenate([time_optimal, rest])] * 6))
    whole = firm_motions(many, model, 0.4, DT)
    assert len(whole) == 6
    for begin, end in ((0.0, many.t[-1]), (0.6, 1.5), (0.62, 0.63), (1.0, 1.1), (9.0, 10.0), (-5.0, -4.0)):
        inside = whole[(whole[:, 0] >= begin) & (whole[:, 1] <= end)]
        np.testing.assert_allclose(firm_motions(many, model, 0.4, DT, (begin, end)), inside, atol=1e-9)


def test_weights_that_only_firmness_takes_beyond_their_range_are_refused_by_its_name():
    """It spoke of a position_error of 3.3e-10, which nobody had set."""
    with pytest.raises(ParameterError, match=r"^firmness: 30 times as firm.*position_error"):
        firm(MpcConfig(position_error=1e-9, firm_time=0.3, firmness=30.0))
