"""Modes and frequency responses against closed forms, direct solutions and the state space."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arms import arm, tree

from flexarm_model.manipulator.sensor_spec import SensorSpec
from flexarm_model.modal.frf import KINDS, Frf, Ports, exact_frf, modal_frf
from flexarm_model.modal.model_frf import displacement_row, model_frf
from flexarm_model.modal.modes import (
    Modes,
    damped_poles,
    frequency_and_damping,
    model_modes,
    normal_modes,
    poles_of,
)
from flexarm_model.served.linearize import linearize
from flexarm_model.served.reduced_model import ReducedModel
from flexarm_model.served.state_space import state_space
from flexarm_model.tree.reduced_tree import ReducedTree

Matrices = tuple[np.ndarray, np.ndarray, np.ndarray]
LINES = np.arange(0.5, 60.0, 0.5)
M1, D1, K1 = 2.0, 6.0, 9000.0  # one degree of freedom: 10.7 Hz, 2.2 %


def chain(proportional: bool = True, n: int = 5) -> Matrices:
    """Return masses between springs, ends free to the wall, with damping of either sort."""
    K = 4e3 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    M = np.diag(np.linspace(1.0, 2.0, n))
    D = 1e-3 * K + 0.5 * M if proportional else np.diag([40.0] + [0.0] * (n - 1))
    return M, D, K


def corner(n: int) -> Ports:
    return Ports(np.eye(n)[:, :2], np.eye(n)[-3:])


@pytest.fixture(scope="module")
def link() -> ReducedModel:
    return linearize(tree("single_link", "geared"))


def test_one_degree_of_freedom_has_the_response_of_the_textbook() -> None:
    w = 2 * np.pi * LINES
    one = Ports(np.eye(1), np.eye(1))
    for kind, power in KINDS.items():
        expected = (1j * w) ** power / (K1 - M1 * w**2 + 1j * w * D1)
        matrices = np.array([[[M1]], [[D1]], [[K1]]])
        assert exact_frf(LINES, tuple(matrices), one, kind).H[:, 0, 0] == pytest.approx(expected, rel=1e-12)
        modes = normal_modes(*matrices)
        assert modal_frf(LINES, modes, one, kind).H[:, 0, 0] == pytest.approx(expected, rel=1e-12)
    assert modes.f_hz[0] == pytest.approx(np.sqrt(K1 / M1) / (2 * np.pi))
    assert modes.zeta[0] == pytest.approx(D1 / (2 * np.sqrt(K1 * M1)))


def test_two_equal_masses_swing_together_and_against_each_other() -> None:
    K = np.array([[3.0, -1.0], [-1.0, 3.0]])
    modes = normal_modes(np.eye(2), np.zeros((2, 2)), K)
    assert modes.omega == pytest.approx(np.sqrt([2.0, 4.0]))
    assert abs(modes.shapes) == pytest.approx(np.full((2, 2), np.sqrt(0.5)))
    f = np.array([0.1])
    H = exact_frf(f, (np.eye(2), np.zeros((2, 2)), K), Ports(np.eye(2), np.eye(2))).H[0]
    x = (2 * np.pi * 0.1) ** 2
    assert H.real == pytest.approx(np.array([[3 - x, 1], [1, 3 - x]]) / ((3 - x) ** 2 - 1))


def test_all_modes_of_a_proportionally_damped_chain_give_its_exact_response() -> None:
    matrices = chain()
    exact = exact_frf(LINES, matrices, corner(5), "accelerance").H
    modal = modal_frf(LINES, normal_modes(*matrices), corner(5), "accelerance").H
    assert modal == pytest.approx(exact, rel=1e-9)


def test_more_modes_come_nearer_to_the_exact_response_below_them() -> None:
    matrices = chain()
    modes, low = normal_modes(*matrices), LINES[LINES < 4.0]
    exact = exact_frf(low, matrices, corner(5)).H
    errors = [abs(modal_frf(low, modes.first(r), corner(5)).H - exact).max() for r in range(1, 6)]
    assert (np.diff(errors) < 0.0).all()
    with pytest.raises(ValueError, match="6 modes asked for, 1 to 5 exist"):
        modes.first(6)


def test_responses_are_reciprocal() -> None:
    frf = exact_frf(LINES, chain(proportional=False), Ports(np.eye(5), np.eye(5)))
    there, back = frf.H, frf.transposed().H
    assert there == pytest.approx(back, rel=1e-10)


def test_kinds_convert_into_each_other_and_back() -> None:
    receptance = exact_frf(LINES, chain(), corner(5))
    acceleration = receptance.converted("accelerance").H
    back = receptance.converted("mobility").converted("receptance").H
    assert acceleration == pytest.approx(-((2 * np.pi * LINES[:, None, None]) ** 2) * receptance.H)
    assert back == pytest.approx(receptance.H)
    assert receptance.db(1e-6)[3, 1, 0] == pytest.approx(20 * np.log10(abs(receptance.H[3, 1, 0]) * 1e6))
    assert receptance.band(2.0, 3.0).f_hz.tolist() == [2.0, 2.5, 3.0]


def test_poles_see_the_damping_that_modes_leave_out() -> None:
    M, D, K = chain(proportional=False)
    poles = damped_poles(M, D, K)
    for pole in poles:  # each makes the dynamic stiffness singular
        stiffness = pole**2 * M + pole * D + K
        assert np.linalg.svd(stiffness, compute_uv=False)[-1] < 1e-9 * np.linalg.norm(stiffness)
    f_hz, zeta = frequency_and_damping(poles)
    assert poles_of(f_hz, zeta) == pytest.approx(poles)
    assert abs(f_hz / normal_modes(M, D, K).f_hz - 1).max() > 0.01  # heavy local damping moves them


def test_an_overdamped_coordinate_has_two_real_poles() -> None:
    poles = damped_poles(np.eye(1), np.array([[5.0]]), np.array([[4.0]]))
    assert poles == pytest.approx(np.array([-1.0, -4.0]))


def test_sensor_responses_are_those_of_the_state_space(link: ReducedModel) -> None:
    system = state_space(link, np.zeros(link.n))
    f = np.array([0.7, 5.0, 33.0, 90.0])
    for names in (["tip_accelerometer.y"], ["root_strain.strain", "tip.ty", "encoder.position"]):
        rows = [link.outputs.names.index(name) for name in names]
        found = model_frf(link, f, names, ["base.rz"], locked=False)
        for i, s in enumerate(2j * np.pi * f):
            x = np.linalg.solve(s * np.eye(system.n_x) - system.A, system.B)
            assert found.H[i] == pytest.approx((system.C @ x + system.D)[rows], rel=1e-8)
        assert found.kind == ("accelerance" if names[0].startswith("tip_a") else "receptance")


def test_sensors_of_an_arm_under_gravity_read_their_tilt_and_their_rate() -> None:
    """At 1 Hz the tilt is most of what an accelerometer reads; a gyroscope had no response at all."""
    sensors = tuple(
        SensorSpec(name, name, str(arm("spatial").tip), ("x", "y", "z"), np.ones(3))
        for name in ("accelerometer", "gyroscope")
    )
    model = linearize(ReducedTree(replace(arm("spatial"), sensors=sensors), use_compiler=False))
    system, f = state_space(model, np.zeros(model.n)), np.array([0.3, 1.0, 7.0, 40.0])
    for sensor, kind in (("accelerometer", "accelerance"), ("gyroscope", "mobility")):
        names = [f"{sensor}.{channel}" for channel in "xyz"]
        rows = [model.outputs.names.index(name) for name in names]
        found = model_frf(model, f, names, [*model.theta_names], locked=False)
        assert found.kind == kind
        for i, s in enumerate(2j * np.pi * f):
            x = np.linalg.solve(s * np.eye(system.n_x) - system.A, system.B)
            assert found.H[i] == pytest.approx((system.C @ x + system.D)[rows], rel=1e-8, abs=1e-12)
    turn = displacement_row(model, "gyroscope.z")  # a torque about z turns what the gyroscope tells
    assert turn == pytest.approx(model.outputs.C_vel[model.outputs.names.index("gyroscope.z")])
    still = model_frf(linearize(tree("planar")), LINES, ["tip.tz"], ["tip.ty"])  # nothing moves it
    assert not still.H.any()


def test_a_hammer_on_the_locked_link_excites_its_served_modes(link: ReducedModel) -> None:
    frf = model_frf(link, link.omega / (2 * np.pi), ["tip.ty"], ["tip.ty"])
    shape = link.outputs.C_pos[link.outputs.names.index("tip.ty"), 1:]
    peak = shape**2 / (2 * link.zeta * link.omega**2)
    assert -frf.H[:, 0, 0].imag == pytest.approx(peak, rel=0.01)  # the other modes add next to nothing there
    assert model_modes(link).shapes.shape == (4, 3) and model_modes(link, locked=False).omega[0] < 1e-3


def test_what_cannot_be_answered_is_refused(link: ReducedModel) -> None:
    M = np.eye(5)
    nothing = np.zeros((5, 5))
    free = Modes(np.zeros(1), np.zeros(1), np.ones((5, 1)))
    with pytest.raises(ValueError, match="undamped mode lies there"):
        modal_frf(np.zeros(1), free, corner(5))
    with pytest.raises(ValueError, match="undamped mode lies there"):
        exact_frf(np.zeros(1), (M, nothing, nothing), corner(5))
    with pytest.raises(ValueError, match="'speed' is not one of receptance, mobility, accelerance"):
        exact_frf(LINES, chain(), corner(5), "speed")
    with pytest.raises(ValueError, match="do not fit H"):
        Frf(LINES, np.ones((3, 1, 1), dtype=complex))
    with pytest.raises(ValueError, match="lines must ascend"):
        Frf(-LINES, np.ones((LINES.size, 1, 1), dtype=complex))
    with pytest.raises(ValueError, match="0 Hz cannot become receptance"):
        exact_frf(np.array([0.0, 1.0]), chain(), corner(5), "mobility").converted("receptance")
    with pytest.raises(ValueError, match="no line in 70.0..80.0 Hz"):
        exact_frf(LINES, chain(), corner(5)).band(70.0, 80.0)
    with pytest.raises(ValueError, match="different kinds"):
        model_frf(link, LINES, ["tip_accelerometer.y", "tip.ty"], ["tip.ty"])
    with pytest.raises(ValueError, match="locked axis takes its torque itself: base.rz"):
        model_frf(link, LINES, ["tip.ty"], ["base.rz"])
    with pytest.raises(KeyError, match="no output row 'tip.up'; known: encoder.position"):
        model_frf(link, LINES, ["tip.up"], ["tip.ty"])
    assert arm("single_link", "geared").modes == link.n_eta


def test_results_cannot_be_written_to_and_do_not_change_with_their_source() -> None:
    source = np.ones((2, 1, 1), dtype=complex)
    frf = Frf(np.array([1.0, 2.0]), source)
    source[0] = 5.0
    assert frf.H[0, 0, 0] == 1.0
    with pytest.raises(ValueError, match="read-only"):
        frf.H[0] = 0.0
