"""Margins of closed loops against eigenvalues, textbook loops and the separation principle."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import event, given
from hypothesis import strategies as st
from kalman_loop import DT, Filter
from scipy.linalg import eigvals
from served_arms import limits_of_hub, single_link, two_axes, two_axis_limits

from flexarm_controller.laws import LAWS, LawInputs
from flexarm_controller.margins.case import ALL_TORQUES, examine
from flexarm_controller.margins.delay_margin import MOST, unstable_zeros
from flexarm_controller.margins.full_plant import PARTS, build_plant
from flexarm_controller.margins.gain_margin import gain_margin
from flexarm_controller.margins.group_margin import may_turn
from flexarm_controller.margins.law_gain import find_law_gain
from flexarm_controller.margins.loop import close_loop
from flexarm_controller.margins.paired_roots import PairedRoots
from flexarm_controller.margins.response import angles_of, decompose
from flexarm_controller.margins.verdict import shortfalls, verdict
from flexarm_controller.mpc import Mpc
from flexarm_controller.program.prediction import plant as served_plant
from flexarm_controller.settings import ControllerConfig, MarginConfig, MpcConfig
from flexarm_model.served.steady_filter import SteadyFilter

ROWS = ("encoder.position", "root_strain.strain", "tip_accelerometer.y")


def settle(model):
    """Return the stationary filter of the tests' closed loop, worked out there by a Riccati solver."""
    filter_ = Filter(model)
    s, gain = filter_.s, filter_.gain
    C, D = s.C[:3], s.D[:3]
    F = s.A - gain @ C @ s.A
    return SteadyFilter(model.model_id, DT, ROWS, (), F, s.B - gain @ (C @ s.B + D), gain)


def law_of(model, limits, delay, law="mpc"):
    inputs = LawInputs(limits, ControllerConfig(law=law), MpcConfig(time_limit=0.0, delay_periods=delay))
    return find_law_gain(LAWS[law](model, inputs), model, limits.effort, delay)


@pytest.fixture(scope="module")
def light_hub():
    model = single_link("light_hub")
    return model, settle(model), limits_of_hub("light_hub")


def loop_of(light_hub, frequency_error=0.0, delay=1, filter_=None):
    model, settled, limits = light_hub
    plant = build_plant(model, settled.rows, DT, frequency_error)
    return close_loop(plant, filter_ or settled, law_of(model, limits, delay), delay)


@pytest.mark.parametrize("delay", [0, 1, 3])
def test_gain_of_the_mpc_is_that_of_its_program(delay):
    model, config = two_axes(), MpcConfig(time_limit=0.0, delay_periods=delay, velocity_limit=False)
    problem = Mpc(model, two_axis_limits(), config, DT).problem
    found = law_of(model, two_axis_limits(), delay)
    torques = -problem.T[:2, : problem.n_v] @ np.linalg.solve(
        problem.P[: problem.n_v, : problem.n_v], problem.q_now[: problem.n_v]
    )
    known, system = problem.known, served_plant(model, DT)
    periods = max(delay, 1)  # nothing acts sooner
    A = np.linalg.matrix_power(system.A, periods)
    np.testing.assert_allclose(found.x, torques[:, known.x] @ A, rtol=1e-6, atol=1e-6 * abs(found.x).max())
    late = sum((np.linalg.matrix_power(system.A, k) @ system.B for k in range(periods)), np.zeros((10, 2)))
    d = torques[:, known.d] + torques[:, known.x] @ late
    np.testing.assert_allclose(found.d, d, rtol=1e-6, atol=1e-6 * abs(d).max())


@pytest.mark.parametrize("law", ["lqr", "pd"])
def test_other_laws_are_asked_the_same_way(law):
    model, limits = single_link(), limits_of_hub()
    gain = law_of(model, limits, 1, law)
    assert gain.x[0, 0] < 0.0  # it pulls back


def test_poles_are_those_of_regulator_and_filter_where_the_arm_is_as_served(light_hub):
    loop = loop_of(light_hub)
    model, settled, limits = light_hub
    system, law = served_plant(model, DT), law_of(model, limits, 1)
    regulator = np.block([[system.A, system.B], [law.x, law.sent]])
    expected = np.concatenate([np.linalg.eigvals(regulator), np.linalg.eigvals(settled.F)])
    found = np.linalg.eigvals(loop.A)
    assert found.size == expected.size
    for pole in expected:  # multiple poles split by the root of rounding
        assert abs(found - pole).min() < 1e-6


def test_full_plant_with_the_served_modes_is_the_served_plant(light_hub):
    model, settled, _ = light_hub
    plant, system = build_plant(model, settled.rows, DT, 0.0), served_plant(model, DT)
    np.testing.assert_allclose(
        np.sort_complex(np.linalg.eigvals(plant.A)), np.sort_complex(np.linalg.eigvals(system.A)), atol=1e-7
    )
    markov = [plant.C @ np.linalg.matrix_power(plant.A, k) @ plant.force @ plant.b for k in range(4)]
    rows = [model.outputs.names.index(row) for row in settled.rows]
    expected = [system.C[rows] @ np.linalg.matrix_power(system.A, k) @ system.B for k in range(4)]
    np.testing.assert_allclose(markov, expected, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(plant.E @ plant.b, system.D[rows], atol=1e-12)


def test_frequency_error_moves_the_locked_modes_and_keeps_their_ratios(light_hub):
    model, settled, _ = light_hub
    plant, stiffer = build_plant(model, settled.rows, DT, 0.1), single_link("light_hub", 1.1)
    free = np.sqrt(np.sort(eigvals(stiffer.K, stiffer.M).real).clip(0.0))
    np.testing.assert_allclose(plant.omega[1:], free[1:], rtol=1e-9)
    assert plant.names == ("axes", "mode_1", "mode_2", "mode_3")
    assert (plant.omega[1:] >= stiffer.omega).all()  # locking the axis slows a mode
    poles, expected = (np.sort(abs(eigvals(A))) for A in (plant.A, served_plant(stiffer, DT).A))
    np.testing.assert_allclose(poles, expected, atol=1e-6)  # how fast vibration dies out


def test_parts_of_a_period_add_up_to_it(light_hub):
    model, settled, _ = light_hub
    plant = build_plant(model, settled.rows, DT, 0.0)
    half = build_plant(model, settled.rows, DT / 2, 0.0)
    np.testing.assert_allclose(plant.early[PARTS // 2], half.A @ half.force, atol=1e-14)
    np.testing.assert_allclose(plant.force - plant.early[PARTS // 2], half.force, atol=1e-14)


@pytest.mark.parametrize("gain", [0.2, 0.5, 0.9])
def test_integrator_with_unit_delay_has_the_gain_margin_of_the_textbook(gain):
    z = np.exp(1j * np.linspace(0.0, np.pi, 4001))
    margin = gain_margin(-gain / (z * (z - 1.0) + gain))  # of gain / (z (z - 1)): stable up to one
    assert margin.up == pytest.approx(1.0 / gain, rel=1e-5)
    assert margin.down == 0.0


@pytest.mark.parametrize("frequency_error", [-0.1, 0.0, 0.1])
def test_every_gain_margin_puts_an_eigenvalue_on_the_circle(light_hub, frequency_error):
    loop = loop_of(light_hub, frequency_error)
    case = examine(loop, np.zeros(1), frequency_error, DT)
    forces = loop.plant.b @ loop.torque
    assert case.is_stable
    for j in range(1, 4):
        margin = case.margin(f"mode_{j}").gain
        for factor, beyond in ((margin.up, 1.01), (margin.down, 0.99)):
            if 0.0 < factor < 1e3:
                radius = [_radius(loop.A + (g - 1.0) * np.outer(loop.enter[:, j], forces[j]))
                          for g in (factor, factor * beyond, 1.0 + 0.98 * (factor - 1.0))]  # fmt: skip
                assert radius[0] == pytest.approx(1.0, abs=2e-4)
                assert radius[1] > 1.0 > radius[2]


def test_margin_of_all_torques_is_the_factor_at_which_the_loop_becomes_unstable(light_hub):
    loop = loop_of(light_hub)
    margin = examine(loop, np.zeros(1), 0.0, DT).margin(ALL_TORQUES).gain

    def radius(factor):
        """Return the spectral radius with all torques that reach the arm times ``factor``."""
        return _radius(loop.A + (factor - 1.0) * loop.enter @ loop.plant.b @ loop.torque)

    assert radius(0.99 * margin.up) < 1.0 < radius(1.01 * margin.up)
    if margin.down:
        assert radius(1.01 * margin.down) < 1.0 < radius(0.99 * margin.down)


@pytest.mark.parametrize("name", [ALL_TORQUES, "mode_1", "mode_2"])
@pytest.mark.parametrize("frequency_error", [-0.1, 0.0])
def test_delay_margin_is_where_the_late_loop_becomes_unstable(light_hub, name, frequency_error):
    loop = loop_of(light_hub, frequency_error)
    margin = examine(loop, np.zeros(1), frequency_error, DT).margin(name)
    modes = slice(None) if name == ALL_TORQUES else [int(name[-1])]
    parts = round(margin.delay / DT * PARTS)
    assert all(_radius(_late_loop(loop, modes, k)) < 1.0 for k in range(parts + 1))
    if margin.is_delay_open:
        assert parts == MOST * PARTS
    else:
        assert _radius(_late_loop(loop, modes, parts + 1)) > 1.0


def test_turns_about_zero_count_unstable_zeros():
    angles = angles_of(np.array([0.5 + 0.0j]))
    z = np.exp(1j * angles)
    assert unstable_zeros((z - 0.5) / (z - 0.9)) == 0
    assert unstable_zeros((z - 1.5) / (z - 0.9)) == 1
    pair = (z - 1.1 * np.exp(1j)) * (z - 1.1 * np.exp(-1j))
    assert unstable_zeros(pair / (z - 0.9) ** 2) == 2


@given(st.integers(0, 2**32 - 1), st.integers(1, 6), st.floats(-3.0, 1.0))
def test_the_angles_that_are_looked_at_count_as_all_of_them_do(seed, torques, log_size):
    """Torques in N m beside such in kN: norms depend on the units, what is counted does not."""
    rng = np.random.default_rng(seed)
    values = 0.98 * np.sqrt(rng.uniform(size=4)) * np.exp(1j * rng.uniform(0, np.pi, size=4))
    angles = angles_of(values)
    z = np.exp(1j * angles)[:, None, None]
    units = 10.0 ** rng.uniform(-3.0, 3.0, size=torques)
    answer = np.zeros((angles.size, torques, torques), dtype=complex)
    for value in values:
        parts = rng.normal(size=(2, torques, torques))
        # a pair of poles with real residues
        pair = (parts[0] * z + parts[1]) / (z**2 - 2.0 * value.real * z + abs(value) ** 2)
        answer += 10.0**log_size * (1.0 - abs(value)) * pair * units / units[:, None]
    looked_at = may_turn(answer)
    counts = [PairedRoots(part).unstable_zeros(1.0) for part in (answer, answer[looked_at])]
    assert counts[0] == counts[1]
    event("some are not looked at" if not looked_at.all() else "all are looked at")
    event("unstable" if counts[0] else "stable")


def test_participation_of_all_states_in_a_mode_makes_one(light_hub):
    modes = decompose(loop_of(light_hub).A)
    shares = (modes.right * modes.left.T).sum(axis=0)
    np.testing.assert_allclose(shares, 1.0, atol=1e-7)
    scaled = decompose(np.diag([1.0, 1e6]) @ np.array([[0.5, 0.2], [0.1, 0.3]]) @ np.diag([1.0, 1e-6]))
    plain = decompose(np.array([[0.5, 0.2], [0.1, 0.3]]))
    np.testing.assert_allclose(scaled.participation(0), plain.participation(0), rtol=1e-9)


def test_verdict_names_the_mode_of_an_unstable_loop(light_hub):
    loop = loop_of(light_hub)
    forces = loop.plant.b @ loop.torque
    worse = replace(loop, A=loop.A + 100.0 * np.outer(loop.enter[:, 2], forces[2]))
    case = examine(worse, np.zeros(1), 0.0, DT)
    assert not case.is_stable and case.mode == "mode_2" and case.margins == ()
    assert verdict([case], MarginConfig(), DT, ()).startswith("margins: mode 2 is unstable, it grows by ")
    with pytest.raises(KeyError, match="none, the loop is unstable"):
        case.margin("mode_1")


@pytest.mark.parametrize(
    ("served", "remedy"),
    [
        (("mode_1",), "; mode 1 is served: a larger mpc.modal_energy, fewer estimator.stiffness_modes?"),
        (
            (),
            "; mode 1 is not served: a larger estimator.strain_error, estimator.acceleration_error? "
            "see docs/margins.md",
        ),
    ],
)
def test_verdict_says_what_helps_a_mode_that_is_served_or_not(light_hub, served, remedy):
    case = examine(loop_of(light_hub), np.zeros(1), 0.0, DT)
    low = replace(case, margins=(case.margin("mode_1"),))
    assert verdict([low], MarginConfig(gain_margin_db=60.0), DT, served).endswith(remedy)
    torques = replace(case, margins=(case.margin(ALL_TORQUES),))
    assert "?" not in verdict([torques], MarginConfig(torque_gain_margin_db=60.0), DT, served)


@pytest.mark.parametrize("path", ["mode_1", ALL_TORQUES])
def test_what_helps_joint_pd_is_its_own_setting(light_hub, path):
    """The weight of MPC was named, which joint PD does not have."""
    case = examine(loop_of(light_hub), np.zeros(1), 0.0, DT)
    low = replace(case, margins=(case.margin(path),))
    wanted = MarginConfig(gain_margin_db=60.0, torque_gain_margin_db=60.0)
    said = verdict([low], wanted, DT, ("mode_1",), "pd")
    assert "controller.pd_bandwidth" in said
    assert "mpc." not in said


def test_verdict_wants_less_where_frequencies_are_off(light_hub):
    cases = [examine(loop_of(light_hub, error), np.zeros(1), error, DT) for error in (-0.1, 0.0)]
    found = min(case.margin("mode_1").gain.decibels for case in cases)
    strict = MarginConfig(gain_margin_db=60.0, off_share=0.0)
    assert {item.case.frequency_error for item in shortfalls(cases, strict, DT)} == {0.0}
    lenient = MarginConfig(gain_margin_db=0.9 * found, torque_gain_margin_db=0.0, delay_margin_periods=0.0)
    assert verdict(cases, lenient, DT, ()) == ""


def test_law_is_not_judged_where_a_motor_cannot_hold_the_arm():
    model = replace(two_axes(), f0=np.array([30.0, 0.0, 0.0, 0.0, 0.0]))  # more than the motor holds
    with pytest.raises(
        ValueError,
        match=r"axis a.rz: its motor is too weak for pose \(0.3, -0.2\): .* 30 N m, its effort is 8 N m",
    ):
        law_of(model, two_axis_limits(), 1)


def _radius(A):
    return abs(np.linalg.eigvals(A)).max()


def _late_loop(loop, modes, part):
    """Return the loop with the force on some modes late by parts of a period, their past as more states."""
    periods, rest = divmod(part, PARTS)
    forces = (loop.plant.b @ loop.torque)[modes]
    enter, early = loop.enter[:, modes], loop.early[rest][:, modes]
    n, m = len(loop.A), len(forces)
    A = np.zeros((n + (MOST + 1) * m,) * 2)
    past = [slice(n + k * m, n + (k + 1) * m) for k in range(MOST + 1)]  # forces of 1, 2, ... periods ago
    A[:n, :n] = loop.A - enter @ forces
    for age, columns in ((periods, enter - early), (periods + 1, early)):
        A[:n, slice(0, n) if age == 0 else past[age - 1]] += columns @ forces if age == 0 else columns
    A[past[0], :n] = forces
    for k in range(MOST):
        A[past[k + 1], past[k]] = np.eye(m)
    return A
